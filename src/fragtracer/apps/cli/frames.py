# SPDX-License-Identifier: MIT
"""Frames of a film: which there are, where they go, and which are there already."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import ValidationError

from fragtracer.apps.cli import video
from fragtracer.apps.cli.picture import Picture
from fragtracer.apps.cli.preparation import preparing
from fragtracer.camera_path import CameraPath, turntable
from fragtracer.display.exposure import cells, stops_for
from fragtracer.errors import FragtracerError, OutputError
from fragtracer.io.images import check_writable, read_metadata
from fragtracer.io.toml.camera_paths import load_camera_path
from fragtracer.renderer import Renderer
from fragtracer.scene import Camera, Scene
from fragtracer.scene.content import content_digest

_NUMBERS = re.compile(r"#+")
_SEEDS = 2**32
_METERED, _METERED_SPP, _METERED_SIDE = 8, 16, 256  # frames that decide over the exposure, samples and pixels of them
_PICTURES = (".png", ".exr", ".hdr")  # a .npy cannot say which frame it is


@dataclass(frozen=True)
class Frames:
    """The ``scenes`` of the frames that are asked for, by number, of those of a ``path``, the cameras of the frames
    before them, and the ``files`` that they go to; a ``film`` of ``fps`` frames a second is made of them if its name is
    given."""

    scenes: Mapping[int, Scene]
    path: CameraPath
    previous_cameras: Mapping[int, Camera]
    files: Mapping[int, Path]
    film: Path | None
    fps: Fraction

    @property
    def count(self) -> int:
        """Frames of the whole path."""
        return len(self.path.frames)

    def make_folder(self) -> None:
        """Make the one that the files of a film go to; raises :class:`OutputError` where that cannot be."""
        folder = next(iter(self.files.values())).parent
        try:
            folder.mkdir(exist_ok=True)
        except OSError as error:
            raise OutputError(f"{folder}: cannot be the folder of the frames: {error.strerror}") from error


def frames_of(
    scene: Scene, output: Path, frames: str | None, path: Path | None, turns: int | None, fps: float | None
) -> Frames:
    """The frames ``frames``, as "1-240" or "7", or all, along a camera path of the file ``path`` or of a turntable of
    ``turns`` frames. Frame n has the seed of the scene and n.

    Raises
    ------
    FragtracerError
        If there is not one path, a frame is not on it, or the files cannot be written.
    """
    if (path is None) == (turns is None):
        raise FragtracerError("frames need a moving camera: give --path FILE or --turntable FRAMES, one of the two")
    if output.suffix.lower() not in (*video.SUFFIXES, *_PICTURES):
        films, numbered = " or ".join(video.SUFFIXES), f"{output.stem.rstrip('.#')}.####.png"
        kind = output.suffix or "a file without an extension"
        mend = f"give a film, {films}, or numbered pictures, as {numbered}, .exr or .hdr"
        raise OutputError(f"{output}: frames are not written to {kind}; {mend}")
    if fps is not None and output.suffix.lower() not in video.SUFFIXES:
        raise FragtracerError(f"--fps is for films; write one, as -o film.mp4, or leave it out for {output}")
    moving = turntable(scene.camera, turns) if turns is not None else None
    moving = moving or load_camera_path(str(path), scene.camera)
    numbers = _asked(frames, moving)
    film = output if output.suffix.lower() in video.SUFFIXES else None
    files = {number: _file(output, number) for number in numbers}
    if film is not None and frames is not None and film.exists() and _has_others(files):
        mend = "leave that out, since finished frames are not rendered again, or give another file"
        raise OutputError(f"{film}: would be replaced by a film of --frames {frames} alone; {mend}")
    rate = _rate(fps or 24)
    width, height = scene.render.width, scene.render.height
    (video.check(output, width, height, rate) if film else check_writable(files[numbers[0]]))
    scenes = {number: replace(scene, camera=_camera(moving, number)) for number in numbers}
    seeds = {number: (scene.render.seed + number) % _SEEDS for number in numbers}
    scenes = {n: replace(s, render=replace(s.render, seed=seeds[n])) for n, s in scenes.items()}
    first = moving.frames[0]
    before_first = first if turns is None else moving.frames[-1]
    previous = {n: _camera(moving, before_first if n == first else n - 1) for n in numbers}
    return Frames(scenes, moving, previous, files, film, rate)


def exposed_alike(picture: Picture, frames: Frames, scene: Scene) -> Picture:
    """``picture`` with one exposure for all frames of the path in the place of an automatic one for each, which would
    flicker: that of small pictures of some of them together, whichever are asked for."""
    if picture.look[0] != "auto" or next(iter(frames.files.values())).suffix.lower() != ".png":
        return picture
    width, height = scene.render.width, scene.render.height
    shrink = max(1, width / _METERED_SIDE, height / _METERED_SIDE)
    size = max(1, round(width / shrink)), max(1, round(height / shrink))
    even = replace(scene.render, adaptive="off", guiding="off", light_tracing="off", gradient_domain="off")
    luminances = []
    with preparing(), Renderer(replace(scene, render=even), size, moves=True) as renderer:
        for number in frames.path.frames[:: -(-frames.count // _METERED)]:
            renderer.reset(replace(scene, camera=_camera(frames.path, number)))
            luminances.append(cells(renderer.render(_METERED_SPP)).ravel())
    stops = round(stops_for(np.concatenate(luminances)), 2)
    print(f"exposure {stops:+.2f} stops for all frames")
    return replace(picture, look=(stops, *picture.look[1:]))


def digest_of(renderer: Renderer, *more: Any) -> str:
    """Of all that decides over the picture of a frame, ``more`` than the samples included."""
    return content_digest(repr(sorted(renderer.origin().items())), repr(more))


def is_finished(file: Path, digest: str) -> bool:
    """Whether ``file`` is whole and of that ``digest``."""
    try:
        return read_metadata(file).get("frame_digest") == digest
    except FragtracerError:
        return False


def _asked(frames: str | None, path: CameraPath) -> range:
    there = path.frames
    if frames is None:
        return there
    found = re.fullmatch(r"(\d{1,7})(?:-(\d{1,7}))?", frames)
    if not found or int(found[1]) > int(found[2] or found[1]):
        raise FragtracerError(f"--frames {frames}: give the first and the last frame, as --frames 1-240")
    asked = range(int(found[1]), int(found[2] or found[1]) + 1)
    if asked[0] not in there or asked[-1] not in there:
        raise FragtracerError(f"--frames {frames}: the camera moves from frame {there[0]} to {there[-1]}")
    return asked


def _has_others(files: Mapping[int, Path]) -> bool:
    """Whether there are frames of a film besides these ``files``."""
    folder = next(iter(files.values())).parent
    return any(file not in files.values() for file in folder.glob("*.png"))


def _rate(fps: float) -> Fraction:
    """Also of 23.976 and 29.97, which are short for 24000/1001 and 30000/1001."""
    of_television = Fraction(round(fps) * 1000, 1001)
    is_short_for_it = fps != round(fps) and abs(fps - of_television) < 0.005
    return of_television if is_short_for_it else Fraction(fps).limit_denominator(1001)


def _camera(path: CameraPath, frame: int) -> Camera:
    try:
        return path.camera(frame)
    except ValidationError as error:
        problem = error.errors()[0]["msg"].removeprefix("Value error, ")
        raise FragtracerError(f"frame {frame}: {problem}; add a key on the way there") from None


def _file(output: Path, frame: int) -> Path:
    """OUTPUT with the number in the place of its last #s, as many digits at least; of a film, in a folder beside it."""
    if output.suffix.lower() in video.SUFFIXES:
        return output.with_suffix(".frames") / f"{frame:04}.png"
    places = list(_NUMBERS.finditer(output.name))
    if not places:
        example = output.with_name(f"{output.stem}.####{output.suffix}")
        raise FragtracerError(f"-o {output}: mark the place of the frame's number by #, as -o {example}")
    start, end = places[-1].span()
    return output.with_name(f"{output.name[:start]}{frame:0{end - start}}{output.name[end:]}")
