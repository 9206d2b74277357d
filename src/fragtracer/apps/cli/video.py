# SPDX-License-Identifier: MIT
"""Films from pictures, by FFmpeg."""

import shutil
import subprocess
import tempfile
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from fractions import Fraction
from pathlib import Path

from fragtracer import output
from fragtracer.errors import FragtracerError, OutputError
from fragtracer.io.images.formats import opened_png

# 8 bits, 4:2:0, as every player reads them.
_CODECS = {
    ".mp4": ["-c:v", "libx264", "-crf", "16", "-preset", "slow", "-movflags", "+faststart"],
    ".webm": ["-c:v", "libvpx-vp9", "-crf", "20", "-b:v", "0"],
}
SUFFIXES = tuple(_CODECS)
_PATIENCE = 60.0  # seconds for a film of one frame
# The pictures are sRGB; its primaries are those of Rec. 709, of which the film gets the matrix and the studio range.
# The filters say so of the frames, which FFmpeg 9 asks for it, and the options after them are for versions that do not.
_FILTERS = "scale=out_color_matrix=bt709:out_range=tv:flags=accurate_rnd+full_chroma_int,format=yuv420p"
_FILTERS += ",setparams=color_primaries=bt709:color_trc=iec61966-2-1"
_COLORS = ["-vf", _FILTERS, "-color_range", "tv", "-colorspace", "bt709"]
_COLORS += ["-color_primaries", "bt709", "-color_trc", "iec61966-2-1"]


def check(path: Path, width: int, height: int, fps: Fraction) -> None:
    """Raise FragtracerError, before any work is done, if such a film cannot be written."""
    output.check_writable(path, SUFFIXES)
    if width % 2 or height % 2:
        raise OutputError(f"{path}: a film has an even width and height, not {width}x{height}; give another --size")
    _ffmpeg(path, width, height, fps)


def encode(pictures: Sequence[Path], path: Path, fps: Fraction) -> None:
    """Write a film of .png pictures of one size."""
    with opened_png(pictures[0]) as first:
        width, height = first.size
    program = _ffmpeg(path, width, height, fps)
    with output.replacing(path) as part:
        command = [program, *_arguments(path, width, height, fps), str(part)]
        if problem := _problem(command, map(_pixels, pictures)):
            raise OutputError(f"{path}: FFmpeg could not write the film: {problem}")


def _pixels(picture: Path) -> bytes:
    with opened_png(picture) as image:
        return image.convert("RGB").tobytes()


def _ffmpeg(path: Path, width: int, height: int, fps: Fraction) -> str:
    """The program: the first, of the system's and that of imageio-ffmpeg, that writes such a film of a black frame."""
    found = []
    for program in _programs():
        with tempfile.TemporaryDirectory() as folder:
            command = [program, *_arguments(path, width, height, fps), str(Path(folder) / "film")]
            problem = _problem_of_trial(command, bytes(3 * width * height))
        if problem is None:
            return program
        found.append(f"{program}: {problem.splitlines()[0].rpartition('] ')[2]}")
    raise FragtracerError(
        f"{path}: {'; '.join(found) or 'there is no FFmpeg'}; a film of {width}x{height} needs an FFmpeg with "
        f"{_CODECS[path.suffix.lower()][1]}: install one, or type  pip install 'fragtracer[video]'; numbered pictures, "
        "as -o out.####.png, need nothing"
    )


def _programs() -> Iterator[str]:
    if found := shutil.which("ffmpeg"):
        yield found
    with suppress(ImportError, RuntimeError):  # not installed, or without its program
        import imageio_ffmpeg

        yield str(imageio_ffmpeg.get_ffmpeg_exe())


def _arguments(path: Path, width: int, height: int, fps: Fraction) -> list[str]:
    """Of FFmpeg, but for the file that it writes; it is given 8-bit RGB."""
    suffix = path.suffix.lower()
    given = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}", "-r", str(fps), "-i", "-"]
    return ["-y", "-loglevel", "error", *given, *_COLORS, *_CODECS[suffix], "-f", suffix[1:]]


def _problem_of_trial(command: Sequence[str], frame: bytes) -> str | None:
    """Have FFmpeg write a film of one frame; what it says if it cannot, or that it does not end."""
    try:
        done = subprocess.run(command, input=frame, capture_output=True, timeout=_PATIENCE, check=False)
    except OSError as error:
        return error.strerror or str(error)
    except subprocess.TimeoutExpired:
        return f"it has not written a frame within {_PATIENCE:g} s"
    return _said(done.returncode, done.stderr)


def _problem(command: Sequence[str], frames: Iterable[bytes]) -> str | None:
    """Have FFmpeg write ``frames``; what it says if it cannot."""
    try:
        process = subprocess.Popen(command, stdin=subprocess.PIPE, stderr=subprocess.PIPE)
    except OSError as error:
        return error.strerror or str(error)
    with process:
        assert process.stdin is not None
        assert process.stderr is not None
        with suppress(BrokenPipeError), process.stdin as pipe:  # it says why
            for frame in frames:
                pipe.write(frame)
        said = process.stderr.read()
    return _said(process.returncode, said)


def _said(status: int, errors: bytes) -> str | None:
    """Why FFmpeg has ended with ``status``; None if it has not failed."""
    return None if status == 0 else errors.decode(errors="replace").strip() or f"it ends with status {status}"
