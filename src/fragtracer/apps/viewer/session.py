# SPDX-License-Identifier: MIT
"""The state of a viewer that is not on the GPU: the scene, the camera, the selection and the messages."""

import re
import shutil
import time
from collections import Counter
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path

from pydantic import ValidationError

from fragtracer.apps.viewer.display import DisplaySettings
from fragtracer.apps.viewer.document import OBJECTS, Document, History, Part, materials_of
from fragtracer.apps.viewer.merge import merged
from fragtracer.apps.viewer.playback import Playback
from fragtracer.apps.viewer.settings import config_folder, remember_viewpoints, remembered_viewpoints
from fragtracer.errors import FragtracerError, SceneError
from fragtracer.io import open_gltf, playing, toml
from fragtracer.io.model import LIGHT_KINDS, Model
from fragtracer.io.toml.environments import read_panorama
from fragtracer.output import replacing
from fragtracer.resources import folder
from fragtracer.scene import Camera, Environment, Panorama, Pose, RenderSettings, Scene

_TOAST_SECONDS = 5.0
_READING_SECONDS = 15.0  # of a line that names a file to be found again
_NOT_IN_NAMES = r'[\\/:*?"<>|\x00-\x1f]'  # of files, on some system


def path_of(name: str | Path) -> Path:
    """The file that :func:`fragtracer.load` reads: that of a bundled scene, or ``name`` itself."""
    bundled = folder("scenes") / f"{name}.toml"
    return bundled if str(name) in toml.bundled() else Path(name)


def file_name(name: str) -> str:
    """``name``, of a scene, as a file may be called."""
    return re.sub(_NOT_IN_NAMES, "-", name) or "scene"


def fresh(path: Path) -> Path:
    """``path``, numbered if that file exists."""
    number, free = 1, path
    while free.exists():
        number += 1
        free = path.with_stem(f"{path.stem}-{number}")
    return free


@dataclass
class Session:
    """One open scene. ``path`` is its file, None for one made in Python, and ``animation`` the one that is to move its
    models in the place of those that the file names."""

    history: History
    camera: Camera
    home: Camera
    path: Path | None = None
    animation: str | None = None
    display: DisplaySettings = field(default_factory=DisplaySettings)
    selected: Part | None = None
    environment: Environment | None = None  # restored when it is switched on again
    material: str = ""  # the one that is edited, of a mesh with several
    viewpoints: dict[int, Camera] = field(default_factory=dict)
    playback: Playback = field(default_factory=Playback)
    paused: bool = False
    max_samples: int = 0  # per pixel; 0 for no limit
    target_error: float = 0.0  # relative; 0 for no limit
    problem: str = ""  # why the last action failed
    file_problem: str = ""  # why the scene is not as in its file
    version: int = 0  # counts edits of what the picture depends on, except the camera
    _toast: str = ""
    _toast_until: float = 0.0
    _written: set[Path] = field(default_factory=set)  # scene files
    _posed: tuple[Document, Mapping[playing.Played, Model], Document] | None = None  # the last answer of posed
    _shown: tuple[Document, Camera, Scene] | None = None  # and of shown
    _users: tuple[Scene, Counter[str]] | None = None  # and of users()

    def __post_init__(self) -> None:
        self.saved = self.document.scene

    @classmethod
    def of(cls, scene: Scene, path: Path | None = None, animation: str | None = None) -> "Session":
        session = cls(History(Document(scene)), scene.camera, scene.camera, path, animation)
        session.playback.plays = animation is not None
        session.viewpoints = remembered_viewpoints(path)
        return session

    @property
    def document(self) -> Document:
        return self.history.now

    @property
    def settings(self) -> RenderSettings:
        return self.document.scene.render

    @property
    def posed(self) -> Document:
        """The document with its models at the moment of their animations that is shown."""
        document, models = self.document, self.playback.models
        if not models:
            return document
        if self._posed is None or self._posed[0] is not document or self._posed[1] is not models:
            try:
                scene = playing.posed(document.scene, models, self._lit_by)
            except ValueError:  # a file has other parts now, and is about to be read again
                scene = document.scene
            self._posed = document, models, replace(document, scene=scene)
        return self._posed[2]

    @property
    def _lit_by(self) -> Model | None:
        """The model, opened as a scene, whose lights are those of the scene; None where they were edited."""
        if self.path is None or not toml.is_model(self.path):
            return None
        scene, models = self.document.scene, self.playback.models
        model = models.get(playing.played(scene).get(0, ("", "")))
        are_its = all(getattr(scene, kind) == getattr(self.saved, kind) for kind in LIGHT_KINDS)
        return model if model is not None and model.has_lights and are_its else None

    @property
    def shown(self) -> Scene:
        """The scene to render: what is visible, from the current camera."""
        document, camera = self.posed, self.camera
        if self._shown is None or self._shown[0] is not document or self._shown[1] != camera:
            self._shown = document, camera, replace(document.visible, camera=camera)
        return self._shown[2]

    @property
    def is_saved(self) -> bool:
        """Whether the scene is as in its file, but for the camera; hidden parts are there too."""
        return self.document.scene == self.saved

    def users(self, material: str) -> int:
        """How many objects have the material of that name."""
        scene = self.document.scene
        if self._users is None or self._users[0] is not scene:
            parts = (part for kind in OBJECTS for part in getattr(scene, kind))
            self._users = scene, Counter(name for part in parts for name in materials_of(part))
        return self._users[1][material]

    def edit(self, document: Document, label: str) -> None:
        """Replace the document; consecutive edits with the same ``label`` are one step of undo."""
        if self.history.edit(document, label):
            self._changed()

    @contextmanager
    def checked(self) -> Iterator[None]:
        """Make an edit; if the scene model rejects it, the document stays, and the window says why."""
        try:
            yield
        except ValueError as error:
            self.say(_sentence(error))

    def undo(self) -> None:
        self._travel(self.history.undo)

    def redo(self) -> None:
        self._travel(self.history.redo)

    def _travel(self, step: Callable[[], bool]) -> None:
        """Take a step of the history; where it adds or removes objects, the selected one stays selected."""
        before, selected = self.document, self.selected
        if not step():
            return
        if selected is not None:
            kind = selected[0]
            part, parts = before.part(selected), getattr(self.document.scene, kind)
            if len(parts) != len(getattr(before.scene, kind)):
                places = (index for index, each in enumerate(parts) if each is part)
                self.selected = next(((kind, index) for index in places), None)
        self._changed()

    def open(self, name: str | Path) -> None:
        """Open another scene, with its own camera; edits that are not saved are rescued.

        Raises
        ------
        FragtracerError
            If it cannot be read, or the edits cannot be written; nothing has changed then.
        """
        scene = toml.load(name)
        rescued = self.rescue()
        self.path, self.animation = path_of(name), None
        self.history = History(Document(scene))
        self.saved, self.file_problem = scene, ""
        self.camera = self.home = scene.camera
        self.viewpoints = remembered_viewpoints(self.path)
        self.selected, self.environment, self.material = None, None, ""
        self.playback = Playback()
        self._changed()
        self._say_rescued(f"Opened {scene.name}", rescued)

    def light_by(self, path: Path) -> None:
        """Make an image the environment; rotation, strength and visibility of the previous one stay.

        Raises
        ------
        FragtracerError
            If it cannot be read; nothing has changed then.
        """
        scene = self.document.scene
        picture, before = read_panorama(path), scene.environment
        fresh = Environment(image=picture)
        environment = replace(before, image=picture) if before and before.image else fresh
        self.edit(replace(self.document, scene=replace(scene, environment=environment)), f"light by {path}")
        self.history.close()
        self.say(f"Lit by {path.name}")

    def follow(self, files: Collection[Path]) -> None:
        """Read files again that have changed: the scene's own, or else those of its meshes, textures and environment,
        which leaves all edits.

        Raises
        ------
        OutputError
            If edits had to be rescued, and could not be written; nothing has changed then.
        """
        if self.path in files:
            self.reload()
            return
        try:
            theirs = self.saved if self.path is None else toml.load(self.path, animation=self.animation)
            read = cache(read_panorama)

            def followed(document: Document) -> Document:
                return replace(document, scene=_lit_again(merged(self.saved, document.scene, theirs), files, read))

            saved = followed(Document(self.saved)).scene
            self.history.map(followed)
        except FragtracerError as error:
            self.file_problem = str(error)
            return
        except ValueError as error:
            self.file_problem = _sentence(error)
            return
        self.saved, self.file_problem = saved, ""
        self._take_camera(theirs)
        self._read_again()
        self._changed()
        self.say(f"Reloaded {', '.join(sorted({file.name for file in files}))}")

    def reload(self) -> None:
        """Read the scene's file again, as a step that can be undone; edits that are not saved are rescued. The camera
        stays unless that of the file has changed.

        Raises
        ------
        OutputError
            If the edits cannot be written; nothing has changed then.
        """
        if self.path is None:
            return
        try:
            scene = toml.load(self.path, animation=self.animation)
        except FragtracerError as error:
            self.file_problem = str(error)
            return
        rescued = self.rescue()
        self.file_problem = ""
        self._take_camera(scene)
        read = Document(scene)
        read = replace(read, hidden=frozenset(filter(read.has, self.document.hidden)))
        self._read_again()
        if self.history.edit(read, "reload", joins=True):
            self._changed()
        self.saved = scene
        self._say_rescued(f"Reloaded {self.path.name}", rescued)

    def animate(self, mesh: int, animation: str | None) -> None:
        """Have an animation of its file move a mesh, or none.

        Raises
        ------
        SceneError
            If the file cannot be read, or has no such animation, or has other parts now.
        """
        part = self.document.scene.meshes[mesh]
        assert part.file is not None
        model = open_gltf(part.file).model(None if animation is None else Pose(animation))
        try:
            moved = playing.in_pose(part, model)
        except ValueError as error:
            raise SceneError(f"{part.file}: has other parts than when it was opened; reload the scene") from error
        self.edit(self.document.with_part(("meshes", mesh), moved), f"animation of mesh {mesh}")
        self.history.close()

    def _read_again(self) -> None:
        """Begin anew with the animations of files that may have changed."""
        self.playback = replace(self.playback, names={}, models={})

    def _take_camera(self, scene: Scene) -> None:
        if scene.camera != self.home:
            self.camera = self.home = scene.camera

    def rescue(self) -> Path | None:
        """Write edits that are not saved to a new file in the folder of settings, and count them as saved.

        Returns the file, None if there are no such edits.

        Raises
        ------
        OutputError
            If the file cannot be written.
        """
        if self.is_saved:
            return None
        path = fresh(config_folder() / f"rescued-{file_name(self.document.scene.name)}.toml")
        toml.save(replace(self.document.scene, camera=self.camera), path)
        self.saved = self.document.scene
        return path

    def _say_rescued(self, text: str, rescued: Path | None) -> None:
        if rescued is None:
            self.say(text)
        else:
            self.say(f"{text}; the edits that were not saved are in {rescued}", _READING_SECONDS)

    def save(self, path: Path) -> None:
        """Write the scene as it is seen from here; hidden parts are written too.

        A file that is there is kept as ``NAME.toml~`` before it is written for the first time: it may have comments.

        Raises
        ------
        OutputError
            If a file cannot be written.
        """
        kept = path.with_name(f"{path.name}~") if path.exists() and path.resolve() not in self._written else None
        if kept is not None:
            with replacing(kept) as part:
                shutil.copyfile(path, part)
        toml.save(replace(self.document.scene, camera=self.camera), path)
        self._written.add(path.resolve())
        self.path, self.home = path, self.camera
        self.saved, self.file_problem = self.document.scene, ""
        remember_viewpoints(path, self.viewpoints)
        self.say(f"Saved {path}" + (f"; the file of before is {kept.name}" if kept else ""))

    def keep_viewpoint(self, slot: int) -> None:
        """Remember where the camera is, for this scene file in later runs too."""
        self.viewpoints[slot] = self.camera
        remember_viewpoints(self.path, self.viewpoints)
        self.say(f"Viewpoint {slot} saved")

    def say(self, text: str, seconds: float = _TOAST_SECONDS) -> None:
        """Show a line for some seconds."""
        self._toast, self._toast_until = text, time.monotonic() + seconds

    @property
    def toast(self) -> str:
        return self._toast if time.monotonic() < self._toast_until else ""

    def _changed(self) -> None:
        self.version += 1
        if not self.document.has(self.selected):
            self.selected = None


def _lit_again(scene: Scene, files: Collection[Path], read: Callable[[str], Panorama]) -> Scene:
    """``scene`` with its panorama ``read`` again if its file is one of ``files``."""
    environment = scene.environment
    if environment is None or environment.image is None or environment.image.file is None:
        return scene
    file = environment.image.file
    return replace(scene, environment=replace(environment, image=read(file))) if Path(file) in files else scene


def _sentence(error: ValueError) -> str:
    """What a check of the scene model says."""
    if isinstance(error, ValidationError):
        return error.errors(include_url=False)[0]["msg"].removeprefix("Value error, ")
    return str(error)
