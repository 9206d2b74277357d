# SPDX-License-Identifier: MIT
"""Plays animations of models, which a thread poses, so that no frame of the window waits for one."""

import time
from collections.abc import Iterable, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field

from fragtracer.errors import FragtracerError
from fragtracer.io import AnimationError, open_gltf
from fragtracer.io.model import Model
from fragtracer.io.playing import Animated, Played, played
from fragtracer.packing.instances import refit
from fragtracer.scene import Scene

_LONGEST_STEP = 0.5  # seconds that pass for an animation while a frame takes longer


@dataclass
class Playback:
    """The moment of their animations that the models of a scene are shown at.

    All that plays begins at the same time, and begins anew when it ends. ``models`` are as they are now; there are none
    before the first step, when the scene has them as they begin. ``names`` are those of the animations of each file.
    """

    plays: bool = False
    time: float = 0.0  # seconds
    duration: float = 0.0  # of the longest animation, once it is known
    names: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    models: Mapping[Played, Model] = field(default_factory=dict)

    @property
    def moves(self) -> bool:
        """Whether time passes."""
        return self.plays and self.duration > 0

    def advance(self, seconds: float) -> None:
        """Let time pass, if it ``plays``."""
        if self.moves:
            self.time = (self.time + min(seconds, _LONGEST_STEP)) % self.duration


@dataclass(frozen=True)
class _Moment:
    """What there is of the animations of a scene at a time."""

    names: Mapping[str, tuple[str, ...]]
    duration: float
    models: Mapping[Played, Model]


class _Files:
    """The files of a scene, as they are when they are read first."""

    def __init__(self) -> None:
        self._names: dict[str, tuple[str, ...]] = {}
        self._animated: tuple[frozenset[Played], Animated] | None = None

    def at(self, files: Iterable[str], wanted: frozenset[Played], time: float) -> _Moment:
        for file in files:
            if file not in self._names:
                self._names[file] = _names(file)
        if self._animated is None or self._animated[0] != wanted:
            self._animated = wanted, Animated(wanted, repeats=True)
        animated = self._animated[1]
        return _Moment(dict(self._names), animated.duration, animated.models(time))


class Player:
    """Keeps a :class:`Playback` up to date with what is asked of it; :meth:`update` is for each frame."""

    def __init__(self) -> None:
        self._pool = ThreadPoolExecutor(1, "player")
        self._playback: Playback | None = None
        self._files = _Files()
        self._scene: Scene | None = None
        self._used: tuple[frozenset[str], frozenset[Played]] = frozenset(), frozenset()  # by that scene
        self._asked: tuple[frozenset[str], frozenset[Played], float] | None = None
        self._coming: Future[_Moment] | None = None
        self._updated_at = time.perf_counter()

    def update(self, playback: Playback, scene: Scene) -> bool:
        """Let time pass, and pose in the background what plays in ``scene``, whose models are read anew for another
        ``playback``. Returns whether that has other models now.

        Raises
        ------
        FragtracerError
            If a model cannot be posed; it stays as it is, and nothing plays any more.
        """
        now = time.perf_counter()
        playback.advance(now - self._updated_at)
        self._updated_at = now
        if playback is not self._playback:
            self._playback, self._files, self._asked, self._coming = playback, _Files(), None, None
        is_new = False
        if self._coming is not None and self._coming.done():
            coming, self._coming = self._coming, None
            is_new = self._take(playback, coming)
            if is_new:
                _refit(scene, playback.models)
        if scene is not self._scene:
            files = frozenset(mesh.file for mesh in scene.meshes if mesh.file)
            self._scene, self._used = scene, (files, frozenset(played(scene).values()))
        wanted = *self._used, playback.time
        if self._coming is None and wanted != self._asked and (self._used[0] or self._asked):
            self._asked, self._coming = wanted, self._pool.submit(self._files.at, *wanted)
        return is_new

    def _take(self, playback: Playback, coming: Future[_Moment]) -> bool:
        assert self._asked is not None
        try:
            moment = coming.result()
        except FragtracerError:
            playback.plays = False
            raise
        playback.names, playback.duration = moment.names, moment.duration
        playback.time = min(playback.time, moment.duration)  # another animation may be shorter
        if not (playback.models or self._asked[2] > 0):
            return False
        playback.models = moment.models
        return True

    def close(self) -> None:
        """End the thread, with what it does now."""
        self._pool.shutdown(cancel_futures=True)


def _names(file: str) -> tuple[str, ...]:
    """Those of the animations in the file of a model."""
    try:
        return tuple(open_gltf(file).animations.names)
    except AnimationError:  # another kind of file
        return ()


def _refit(scene: Scene, models: Mapping[Played, Model]) -> None:
    """Let ``models`` share the BVHs of the meshes of ``scene``, which they are in another pose."""
    for index, key in played(scene).items():
        if key in models:
            refit(scene.meshes[index], models[key].mesh)
