# SPDX-License-Identifier: MIT
"""The state of a viewer that is not on the GPU: the scene, the camera, the selection and the messages."""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path

from pydantic import ValidationError

from fragtracer.apps.viewer.display import DisplaySettings
from fragtracer.apps.viewer.document import Document, History, Part
from fragtracer.apps.viewer.settings import remember_viewpoints, remembered_viewpoints
from fragtracer.errors import FragtracerError
from fragtracer.io import toml
from fragtracer.io.toml.environments import read_panorama
from fragtracer.resources import folder
from fragtracer.scene import Camera, Environment, RenderSettings, Scene

_TOAST_SECONDS = 5.0


def path_of(name: str | Path) -> Path:
    """The file that :func:`fragtracer.load` reads: that of a bundled scene, or ``name`` itself."""
    bundled = folder("scenes") / f"{name}.toml"
    return bundled if str(name) in toml.bundled() else Path(name)


@dataclass
class Session:
    """One open scene. ``path`` is its file, None for one made in Python."""

    history: History
    camera: Camera
    home: Camera
    path: Path | None = None
    display: DisplaySettings = field(default_factory=DisplaySettings)
    selected: Part | None = None
    environment: Environment | None = None  # restored when it is switched on again
    material: str = ""  # the one that is edited, of a mesh with several
    viewpoints: dict[int, Camera] = field(default_factory=dict)
    paused: bool = False
    max_samples: int = 0  # per pixel; 0 for no limit
    target_error: float = 0.0  # relative; 0 for no limit
    problem: str = ""  # stays until it is solved
    version: int = 0  # counts edits of what the picture depends on, except the camera
    saved: Document | None = None
    _toast: str = ""
    _toast_at: float = 0.0

    @classmethod
    def of(cls, scene: Scene, path: Path | None = None) -> "Session":
        session = cls(History(Document(scene)), scene.camera, scene.camera, path)
        session.saved = session.document
        session.viewpoints = remembered_viewpoints(path)
        return session

    @property
    def document(self) -> Document:
        return self.history.now

    @property
    def settings(self) -> RenderSettings:
        return self.document.scene.render

    @property
    def shown(self) -> Scene:
        """The scene to render: what is visible, from the current camera."""
        return replace(self.document.visible, camera=self.camera)

    @property
    def is_saved(self) -> bool:
        return self.document == self.saved

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
        if self.history.undo():
            self._changed()

    def redo(self) -> None:
        if self.history.redo():
            self._changed()

    def open(self, name: str | Path) -> None:
        """Open another scene, with its own camera.

        Raises
        ------
        SceneError
            If it cannot be read; nothing has changed then.
        """
        scene = toml.load(name)
        self.path = path_of(name)
        self.history = History(Document(scene))
        self.saved = self.document
        self.camera = self.home = scene.camera
        self.viewpoints = remembered_viewpoints(self.path)
        self.selected, self.environment, self.material = None, None, ""
        self._changed()
        self.say(f"Opened {scene.name}")

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

    def reload(self) -> None:
        """Read the file again, as an edit; the camera stays unless that of the file has changed."""
        if self.path is None:  # a scene made in Python, whose texture has changed
            return
        try:
            scene = toml.load(self.path)
        except FragtracerError as error:
            self.problem = str(error)
            return
        self.problem = ""
        if scene.camera != self.home:
            self.camera = self.home = scene.camera
        self.history.close()
        self.edit(Document(scene), "reload")
        self.saved = self.document
        self.say(f"Reloaded {self.path.name}")

    def save(self, path: Path) -> None:
        """Write the scene as it is seen from here; hidden parts are written too.

        Raises
        ------
        OutputError
            If the file cannot be written.
        """
        toml.save(replace(self.document.scene, camera=self.camera), path)
        self.path, self.home = path, self.camera
        self.saved = self.document
        remember_viewpoints(path, self.viewpoints)
        self.say(f"Saved {path}")

    def keep_viewpoint(self, slot: int) -> None:
        """Remember where the camera is, for this scene file in later runs too."""
        self.viewpoints[slot] = self.camera
        remember_viewpoints(self.path, self.viewpoints)
        self.say(f"Viewpoint {slot} saved")

    def say(self, text: str) -> None:
        """Show a line for some seconds."""
        self._toast, self._toast_at = text, time.monotonic()

    @property
    def toast(self) -> str:
        return self._toast if time.monotonic() - self._toast_at < _TOAST_SECONDS else ""

    def _changed(self) -> None:
        self.version += 1
        if not self.document.has(self.selected):
            self.selected = None


def _sentence(error: ValueError) -> str:
    """What a check of the scene model says."""
    if isinstance(error, ValidationError):
        return error.errors(include_url=False)[0]["msg"].removeprefix("Value error, ")
    return str(error)
