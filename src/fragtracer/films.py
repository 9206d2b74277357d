# SPDX-License-Identifier: MIT
"""Films on disk: checkpoints to go on from, and parts of a picture to be joined (docs/films.md)."""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from functools import reduce
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fragtracer.archive import read_archive, write_archive
from fragtracer.errors import FilmError
from fragtracer.sampling.merging import Moments
from fragtracer.sampling.pixels import Pixels
from fragtracer.scene import RenderSettings, Scene
from fragtracer.scene.digest import scene_digests
from fragtracer.shader_composer import shaders_digest

NAME = "film.npz"  # of the checkpoint in a folder
# In an origin, "on" or "off", which may be measured: by their names there the settings that decide.
DECIDED = {"guided": "guiding", "light_traced": "light_tracing"}
_FORMAT = 2
MOST_SAMPLES = 2**24  # that a count in float32 tells apart
# Settings that only say how much is sampled, and how that is cut.
_AMOUNTS = ("spp", "rays", "width", "height")
_PARTS = ("film.mean", "film.variance", "film.half_difference")


def origin_of(scene: Scene, settings: RenderSettings, root: Path | None = None, **more: object) -> dict[str, str]:
    """What decides over the samples of a picture, as text by name: the content of the scene, settings, versions, and
    ``more`` that the renderer knows."""
    from fragtracer import __version__

    size = f"{settings.width}x{settings.height}"
    parts = {f"scene.{name}": digest for name, digest in scene_digests(scene).items()}
    chosen = {f.name: str(getattr(settings, f.name)) for f in fields(RenderSettings) if f.name not in _AMOUNTS}
    made_by = {"version": __version__, "shaders": shaders_digest(root), "size": size}
    return made_by | parts | chosen | {name: str(value) for name, value in more.items()}


def differences(here: Mapping[str, str], there: Mapping[str, str]) -> str:
    """What two origins differ in, in words; empty if in nothing."""
    names = [name for name in {**here, **there} if here.get(name) != there.get(name)]
    parts = [name.removeprefix("scene.") for name in names if name.startswith("scene.")]
    found = [f"the scene differs in: {', '.join(parts)}"] if parts else []
    for name in names:
        if name == "shaders":
            found.append("the shaders are others")
        elif not name.startswith("scene."):
            mend = f" (--{DECIDED[name].replace('_', '-')} on or off decides)" if name in DECIDED else ""
            found.append(f"{name} is {there.get(name, 'unknown')} there, {here.get(name, 'unknown')} here{mend}")
    return "; ".join(found)


def most_bytes(settings: RenderSettings) -> int:
    """What the arrays of a film of one picture take at most, by what its ``settings`` leave open."""
    pixel = 124  # with layers of light
    if settings.gradient_domain != "off":
        pixel = 192
    if settings.adaptive != "off":
        pixel = 212  # within the first pass of a stage
    if settings.light_tracing != "off":
        pixel += 72
    return pixel * settings.width * settings.height


@dataclass(frozen=True)
class SavedFilm:
    """A film as a file holds it.

    ``origin`` is that of :func:`origin_of`, ``driver`` what rendered, ``ranges`` the numbers of the samples per pixel,
    from the first to the one behind the last; ``metadata`` are those of its image. ``state`` and ``arrays`` are the
    renderer's, the arrays ``film.mean``, ``film.variance`` and ``film.half_difference`` those of :class:`Pixels`.
    """

    origin: Mapping[str, str]
    driver: str
    ranges: tuple[tuple[int, int], ...]
    metadata: Mapping[str, str]
    state: Mapping[str, Any]
    arrays: Mapping[str, NDArray[Any]] = field(repr=False)

    def write(self, path: Path) -> None:
        """Raises :class:`OutputError` if it cannot be written; an older file stays until this one is on the disk."""
        header = {item.name: getattr(self, item.name) for item in fields(self) if item.name != "arrays"}
        write_archive(path, {"format": _FORMAT, **header}, self.arrays)

    @staticmethod
    def read(path: Path) -> "SavedFilm":
        """Raises :class:`FilmError` if it is missing, damaged or of another format."""
        header, arrays = read_archive(path)
        if header.pop("format", None) != _FORMAT:
            mend = "go on with the version that has made it, or render it anew"
            raise FilmError(f"{path}: this film has a format that this version of fragtracer does not know; {mend}")
        try:
            ranges = tuple((int(first), int(end)) for first, end in header.pop("ranges"))
            film = SavedFilm(ranges=ranges, arrays=arrays, **header)
        except (KeyError, TypeError, ValueError) as error:
            raise FilmError(f"{path}: this film is damaged, or not one: {error}") from error
        return film

    def check(self, origin: Mapping[str, str], where: str | Path) -> None:
        """Raise :class:`FilmError` if it is of another picture than ``origin``, saying what differs."""
        if found := differences(origin, self.origin):
            raise FilmError(f"{where}: this film is of another picture: {found}")

    @property
    def spp(self) -> int:
        return sum(end - first for first, end in self.ranges)

    @property
    def pixels(self) -> Pixels:
        """Of a film that is sampled evenly."""
        return Pixels(*(self.arrays[name] for name in _PARTS))


def merge(films: Mapping[str, SavedFilm]) -> SavedFilm:
    """Join films of disjoint samples of one picture; ``films`` are by the names that messages give them.

    They are joined in the order of their samples, in float64, so that the order in which they are given makes no
    difference, and the bits are the same again.

    Raises
    ------
    FilmError
        If they are of different pictures, overlap, are sampled unevenly, or miss one of a pair of samples.
    """
    ordered = sorted(films.items(), key=lambda item: item[1].ranges)
    name, first = ordered[0]
    for other, film in ordered:
        if "cluster" in film.state:
            raise FilmError(f"{other}: is the checkpoint of a cluster, and cannot be merged")
        if "stage" in film.state:
            raise FilmError(f"{other}: was sampled adaptively; only films of --no-adaptive can be merged")
        if film.state.get("is_of_gradients"):
            raise FilmError(f"{other}: was made from differences; only films of --gradient-domain off can be merged")
        if "light_passes" in film.state:
            raise FilmError(
                f"{other}: was rendered with light tracing; only films of --light-tracing off can be merged"
            )
        if found := differences(first.origin, film.origin):
            raise FilmError(f"{other}: is not of the same picture as {name}: {found}")
    ranges = sorted((span, other) for other, film in ordered for span in film.ranges)
    for (one, of_one), (two, of_two) in pairwise(ranges):
        if two[0] < one[1]:
            last = min(one[1], two[1]) - 1
            raise FilmError(f"{of_one} and {of_two} both have the samples {two[0]} to {last} of each pixel")
        if (one[1] - one[0]) % 2:
            raise FilmError(
                f"{of_one}: has {one[1] - one[0]} samples per pixel; all but the last film must have an even number, "
                "since samples belong to two streams in turns (docs/sampling.md)"
            )
    if sum(film.spp for film in films.values()) > MOST_SAMPLES:
        raise FilmError(f"together these are more than the {MOST_SAMPLES} samples per pixel that a film can count")
    pixels = reduce(Moments.merged, (Moments.of(film.pixels) for _, film in ordered)).pixels()
    arrays = dict(zip(_PARTS, (pixels.mean, pixels.variance, pixels.half_difference), strict=True))
    drivers = ", ".join(sorted({film.driver for film in films.values()}))
    joined = replace(
        first, driver=drivers, ranges=tuple(span for span, _ in ranges), state={"merged": len(films)}, arrays=arrays
    )
    counts = {"spp": str(joined.spp), "non_finite_samples": str(int(pixels.variance[..., 3].sum(dtype=np.float64)))}
    counts |= {"samples": ", ".join(f"{a}-{b - 1}" for a, b in joined.ranges), "gl_renderer": drivers}
    return replace(joined, metadata=dict(first.metadata) | counts)
