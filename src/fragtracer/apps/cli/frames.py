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
from fragtracer.camera_path import LAST_FRAME, CameraPath, turned, turntable
from fragtracer.display.exposure import cells, stops_for
from fragtracer.errors import FragtracerError, OutputError
from fragtracer.io.images import check_writable, read_metadata
from fragtracer.io.playing import Playing
from fragtracer.io.toml.camera_paths import load_camera_path
from fragtracer.renderer import Renderer
from fragtracer.scene import Camera, Scene
from fragtracer.scene.content import content_digest
from fragtracer.shutter import Shutter

_NUMBERS = re.compile(r"#+")
_SEEDS = 2**32
_METERED, _METERED_SPP, _METERED_SIDE = 8, 16, 256  # frames that decide over the exposure, samples and pixels of them
_ROUNDING = 1e-4  # of a frame, that an animation may be too short for its last
_PICTURES = (".png", ".exr", ".hdr")  # a .npy cannot say which frame it is


@dataclass(frozen=True)
class Frames:
    """Frames of what moves in the scene ``base``: the camera along a ``path``, what an animation moves, ``playing``, or
    both.

    ``whole`` are the numbers of all frames; those of the ``files`` are asked for. A ``film`` of ``fps`` frames a second
    is made of them if its name is given. The shutter is open for a share ``exposed`` of the time between two frames, of
    which ``moments`` are seen.
    """

    base: Scene
    path: CameraPath | None
    is_turntable: bool
    playing: Playing | None
    whole: range
    files: Mapping[int, Path]
    film: Path | None
    fps: Fraction
    exposed: float = 0.0
    moments: int = 1

    @property
    def count(self) -> int:
        """Frames in all."""
        return len(self.whole)

    def scene(self, number: int) -> Scene:
        """That of a frame, with its seed: of the middle of the time that the shutter is open."""
        found = self._at(number)
        seed = (self.base.render.seed + number) % _SEEDS
        return replace(found, render=replace(found.render, seed=seed))

    def shutter(self, number: int) -> Shutter | None:
        """Of a frame; None where it is a moment."""
        if not self.exposed:
            return None
        name = f"{self.exposed:g} of a frame in {self.moments} moments"
        return Shutter(lambda time: self._at(number + (time - 0.5) * self.exposed), self.moments, name)

    def _at(self, frame: float) -> Scene:
        found = (
            self.base if self.playing is None else self.playing.at(float((Fraction(frame) - self.whole[0]) / self.fps))
        )
        return found if self.path is None else replace(found, camera=self._on_way(self.path, frame))

    def _on_way(self, path: CameraPath, frame: float) -> Camera:
        """The camera: on its ``path``, at whose ends it rests, or around what it looks at."""
        if self.is_turntable:
            return turned(self.base.camera, (frame - 1) / self.count)
        return _camera(path, min(max(frame, self.whole[0]), self.whole[-1]))

    def previous_camera(self, number: int) -> Camera | None:
        """That of the frame before; None where more than the camera moves."""
        if self.path is None or self.playing is not None:
            return None
        first = self.whole[0]
        before_first = self.whole[-1] if self.is_turntable else first
        return _camera(self.path, before_first if number == first else number - 1)

    def make_folder(self) -> None:
        """Make the one that the files of a film go to; raises :class:`OutputError` where that cannot be."""
        folder = next(iter(self.files.values())).parent
        try:
            folder.mkdir(exist_ok=True)
        except OSError as error:
            raise OutputError(f"{folder}: cannot be the folder of the frames: {error.strerror}") from error


def frames_of(
    scene: Scene,
    output: Path,
    frames: str | None,
    path: Path | None,
    turns: int | None,
    fps: float | None,
    playing: Playing | None = None,
    exposed: float = 0.0,
    moments: int = 1,
) -> Frames:
    """The frames ``frames``, as "1-240" or "7", or all, along a camera path of the file ``path`` or of a turntable of
    ``turns`` frames, while what is ``playing`` plays, or, without a path, until that ends. Frame n has the seed of the
    scene and n, and is ``exposed`` for that share of the time between two frames, of which it has ``moments``.

    Raises
    ------
    FragtracerError
        If nothing moves, there are two paths, there is no such frame, or the files cannot be written.
    """
    is_still = path is None and turns is None and playing is None
    if is_still or (path is not None and turns is not None):
        mend = "give --path FILE or --turntable FRAMES, one of the two; or --animation NAME of a model"
        raise FragtracerError(f"frames need a moving camera: {mend}")
    if output.suffix.lower() not in (*video.SUFFIXES, *_PICTURES):
        films, numbered = " or ".join(video.SUFFIXES), f"{output.stem.rstrip('.#')}.####.png"
        kind = output.suffix or "a file without an extension"
        mend = f"give a film, {films}, or numbered pictures, as {numbered}, .exr or .hdr"
        raise OutputError(f"{output}: frames are not written to {kind}; {mend}")
    if fps is not None and output.suffix.lower() not in video.SUFFIXES and playing is None:
        raise FragtracerError(f"--fps is for films; write one, as -o film.mp4, or leave it out for {output}")
    rate = _rate(fps or 24)
    moving = turntable(scene.camera, turns) if turns is not None else None
    moving = load_camera_path(str(path), scene.camera) if path is not None else moving
    whole = moving.frames if moving is not None else _frames_while(playing, rate)
    numbers = _asked(frames, whole, "animation plays" if moving is None else "camera moves")
    film = output if output.suffix.lower() in video.SUFFIXES else None
    files = {number: _file(output, number) for number in numbers}
    if film is not None and frames is not None and film.exists() and _has_others(files):
        mend = "leave that out, since finished frames are not rendered again, or give another file"
        raise OutputError(f"{film}: would be replaced by a film of --frames {frames} alone; {mend}")
    width, height = scene.render.width, scene.render.height
    (video.check(output, width, height, rate) if film else check_writable(files[numbers[0]]))
    found = Frames(scene, moving, turns is not None, playing, whole, files, film, rate, exposed, moments)
    if moving is not None:
        for number in numbers:
            _camera(moving, number)  # refused here, not after the work
    return found


def exposed_alike(picture: Picture, frames: Frames) -> Picture:
    """``picture`` with one exposure for all frames of the path in the place of an automatic one for each, which would
    flicker: that of small pictures of some of them together, whichever are asked for."""
    if picture.look[0] != "auto" or next(iter(frames.files.values())).suffix.lower() != ".png":
        return picture
    width, height = frames.base.render.width, frames.base.render.height
    shrink = max(1, width / _METERED_SIDE, height / _METERED_SIDE)
    size = max(1, round(width / shrink)), max(1, round(height / shrink))
    even = replace(frames.base.render, adaptive="off", guiding="off", light_tracing="off", gradient_domain="off")
    luminances = []
    base, animated = replace(frames.base, render=even), frames.playing is not None
    with preparing(), Renderer(base, size, moves=True, animated=animated) as renderer:
        for number in frames.whole[:: -(-frames.count // _METERED)]:
            renderer.reset(frames.scene(number))
            luminances.append(cells(renderer.render(_METERED_SPP)).ravel())
    stops = round(stops_for(np.concatenate(luminances)), 2)
    print(f"exposure {stops:+.2f} stops for all frames")
    return replace(picture, look=(stops, *picture.look[1:]))


def digest_of(renderer: Renderer, scene: Scene, shutter: Shutter | None, *more: Any) -> str:
    """Of all that decides over the picture of a frame of ``scene`` by ``renderer``, ``more`` than the samples
    included."""
    seen = [scene, *([shutter.at(0.0), shutter.at(1.0)] if shutter else [])]
    origins = [repr(sorted(renderer.origin(each, seed=scene.render.seed).items())) for each in seen]
    return content_digest(*origins, repr((*more, shutter.name) if shutter else more))


def is_finished(file: Path, digest: str) -> bool:
    """Whether ``file`` is whole and of that ``digest``."""
    try:
        return read_metadata(file).get("frame_digest") == digest
    except FragtracerError:
        return False


def _frames_while(playing: Playing | None, rate: Fraction) -> range:
    """From the beginning of what plays to its end, both included."""
    duration = playing.duration if playing is not None else 0.0
    count = 1 + int(duration * float(rate) + _ROUNDING)
    if count > LAST_FRAME:
        raise FragtracerError(f"the animation lasts {duration:g} s, more than {LAST_FRAME} frames; give --path FILE")
    return range(1, count + 1)


def _asked(frames: str | None, there: range, what: str) -> range:
    if frames is None:
        return there
    found = re.fullmatch(r"(\d{1,7})(?:-(\d{1,7}))?", frames)
    if not found or int(found[1]) > int(found[2] or found[1]):
        raise FragtracerError(f"--frames {frames}: give the first and the last frame, as --frames 1-240")
    asked = range(int(found[1]), int(found[2] or found[1]) + 1)
    if asked[0] not in there or asked[-1] not in there:
        raise FragtracerError(f"--frames {frames}: the {what} from frame {there[0]} to {there[-1]}")
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


def _camera(path: CameraPath, frame: float) -> Camera:
    try:
        return path.camera(frame)
    except ValidationError as error:
        problem = error.errors()[0]["msg"].removeprefix("Value error, ")
        raise FragtracerError(f"frame {frame:g}: {problem}; add a key on the way there") from None


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
