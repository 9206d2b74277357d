# SPDX-License-Identifier: MIT
"""One picture on its way: whether it is sampled adaptively, its checkpoints, and what its file says."""

import warnings
from dataclasses import replace
from pathlib import Path

from fragtracer import __version__
from fragtracer.apps.cluster.adaptive import AdaptiveSampling
from fragtracer.apps.cluster.sampling import EvenSampling, PilotSampling, Sampling
from fragtracer.apps.cluster.work import Cut, Frame
from fragtracer.decisions import adaptive_sampling
from fragtracer.errors import FilmError
from fragtracer.films import SavedFilm, origin_of
from fragtracer.sampling.allocation import FIRST_STAGE, decision, least_gain
from fragtracer.sampling.pilot import tiles_of
from fragtracer.scene import RenderSettings, Scene


class Render:
    """The picture of ``scene`` in blocks of ``block`` samples, until it has ``spp`` of each pixel, or an error of
    ``until``; ``frame`` is what it has of its own among others."""

    def __init__(
        self, scene: Scene, block: int, spp: int | None, until: float | None, frame: Frame | None = None
    ) -> None:
        self.frame = frame
        self.origin = origin_of(scene, scene.render)
        self.name, self._settings, self._until = scene.name, scene.render, until
        self._has_meshes = bool(scene.meshes)
        self._least_gain = least_gain(self._has_meshes)
        self.cut = Cut(scene.render.width, scene.render.height, block, spp)
        self._authors: set[tuple[str, str]] = set()  # addresses and drivers of workers that have had a part in it
        self._earlier: set[tuple[str, str]] = set()  # of those that had one in the checkpoint
        self.checked = 0  # tasks that two have rendered
        self.tasks = 0  # that came back
        self.wire = 0  # bytes of films and numbers of samples, there and back
        self.sampling = self._first()

    def _first(self) -> Sampling:
        spp = self._settings.spp if self.cut.spp is None else self.cut.spp
        adaptive, self._why_even = adaptive_sampling(self._settings, spp, self._has_meshes)
        self._gain: float | None = None
        if adaptive == "off" or (self.cut.spp is not None and self.cut.spp <= FIRST_STAGE):
            return EvenSampling(self.cut, self._until)
        if adaptive == "on":
            return AdaptiveSampling(self.cut, self._until)
        if tiles_of(self.cut.width, self.cut.height):
            return PilotSampling(self.cut)
        self._gain = 1.0
        return EvenSampling(self.cut, self._until)

    def advance(self, is_certain: bool) -> bool:
        """Go on where all is there that is needed; whether anything has changed."""
        has_changed = self.sampling.advance(is_certain)
        if isinstance(self.sampling, PilotSampling) and self.sampling.is_done:
            self._decide(self.sampling.gain)
        return has_changed

    def _decide(self, gain: float | None) -> None:
        assert gain is not None
        self._gain = gain
        kind = EvenSampling if gain < self._least_gain else AdaptiveSampling
        self.sampling = kind(self.cut, self._until)

    def note(self, author: str, driver: str) -> None:
        """That this worker has a part in it."""
        if self._earlier and driver not in self._drivers:
            found = f"{self.name}: was rendered by {self.driver}, and goes on with {driver}"
            warnings.warn(f"{found}; bits may differ", stacklevel=2)
        self._authors.add((author, driver))

    def forget(self, author: str) -> None:
        """Render again what this worker has had a part in."""
        self._authors = {known for known in self._authors if known[0] != author}
        self._earlier = {known for known in self._earlier if known[0] != author}
        if not self.sampling.forget(author):
            self.sampling, self._authors, self._earlier = self._first(), set(), set()

    @property
    def authors(self) -> set[str]:
        """The workers that have had a part in it."""
        return {address for address, _ in self._authors | self._earlier}

    @property
    def _drivers(self) -> set[str]:
        return {driver for _, driver in self._authors | self._earlier}

    @property
    def driver(self) -> str:
        """What has rendered it: the different ones."""
        return ", ".join(sorted(self._drivers))

    @property
    def is_done(self) -> bool:
        return self.sampling.is_done

    @property
    def settings(self) -> RenderSettings:
        return self._settings

    @property
    def spp(self) -> float:
        """Samples per pixel that are there, in the mean."""
        return self.sampling.samples / (self.cut.width * self.cut.height)

    @property
    def can_go_on(self) -> bool:
        """Whether :meth:`save` has anything to write from which one could go on with the same bits."""
        return isinstance(self.sampling, EvenSampling) or (
            isinstance(self.sampling, AdaptiveSampling) and self.sampling.can_go_on
        )

    def save(self, path: Path) -> None:
        """Write what is there; raises OutputError if it cannot be written."""
        assert isinstance(self.sampling, EvenSampling | AdaptiveSampling)
        state, arrays = self.sampling.state()
        state |= {"cluster": True, "gain": self._gain, "block": self.cut.samples, "spp": self.cut.spp}
        state |= {"authors": sorted(self._authors | self._earlier), "checked": self.checked}
        SavedFilm(self.origin, self.driver, (), {}, state, arrays).write(path)

    def resume(self, path: Path) -> None:
        """Go on from what :meth:`save` has written; raises :class:`FilmError` where it is of another render."""
        film, cut = SavedFilm.read(path), self.cut
        if "cluster" not in film.state:
            raise FilmError(f"{path}: this film was not rendered on a cluster; go on without --cluster")
        film.check(self.origin, path)
        kind = EvenSampling if "blocks" in film.state else AdaptiveSampling
        cuts = [cut]
        if kind is EvenSampling:
            if film.state["block"] != cut.samples:
                raise FilmError(f"{path}: --block is {film.state['block']} there, {cut.samples} here")
            # With the blocks that it has, or, if that cuts one of them, with one more where it was to end.
            ends, end = tuple(film.state.get("ends", ())), film.state["spp"]
            cuts = [replace(cut, ends=ends)]
            if end is not None and end % 2 == 0:
                cuts.append(replace(cut, ends=(*ends, end)))
        for cut in cuts:
            sampling = kind(cut, self._until)
            if sampling.restore(film.state, film.arrays):
                self.cut, self.sampling, self._gain = cut, sampling, film.state["gain"]
                if self._settings.adaptive == "auto":
                    self._why_even = "off: as it was begun" if self._gain is None else ""
                authors = film.state.get("authors", [("", film.driver)])
                self._earlier = {(address, driver) for address, driver in authors}
                self.checked = film.state.get("checked", 0)
                return
        more = f"samples beyond --spp {cut.spp}, or an odd number of them, which no others can follow"
        raise FilmError(f"{path}: this film has {more}")

    def metadata(self) -> dict[str, str]:
        """For the file, without what is in its pixels."""
        metadata = {name: str(value) for name, value in vars(self._settings).items() if not name.startswith("_")}
        made_by = {"software": f"fragtracer {__version__}", "scene": self.name, "block": str(self.cut.samples)}
        decided = self._why_even or decision(self._settings.adaptive, self._gain, self._least_gain)
        found = {"adaptive_decision": decided}
        found |= {"workers": str(len(self.authors)), "checked_blocks": str(self.checked)}
        return metadata | made_by | found | {"gl_renderer": self.driver}
