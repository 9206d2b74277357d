# SPDX-License-Identifier: MIT
"""Films from pictures, by FFmpeg."""

import shutil
import subprocess
from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path

from fragtracer import output
from fragtracer.errors import FragtracerError, OutputError

# 8 bits, 4:2:0, as every player reads them.
_CODECS = {
    ".mp4": ["-c:v", "libx264", "-crf", "16", "-preset", "slow", "-movflags", "+faststart"],
    ".webm": ["-c:v", "libvpx-vp9", "-crf", "20", "-b:v", "0"],
}
SUFFIXES = tuple(_CODECS)
# The pictures are sRGB; its primaries are those of Rec. 709, of which the film gets the matrix and the studio range.
_COLORS = ["-vf", "scale=out_color_matrix=bt709:out_range=tv:flags=accurate_rnd+full_chroma_int,format=yuv420p"]
_COLORS += ["-color_range", "tv", "-colorspace", "bt709", "-color_primaries", "bt709", "-color_trc", "iec61966-2-1"]


def check(path: Path, width: int, height: int) -> None:
    """Raise FragtracerError, before any work is done, if a film of this size cannot be written."""
    output.check_writable(path, SUFFIXES)
    if width % 2 or height % 2:
        raise OutputError(f"{path}: a film has an even width and height, not {width}x{height}; give another --size")
    _ffmpeg()


def encode(pictures: Sequence[Path], path: Path, fps: Fraction) -> None:
    """Write a film of 8-bit pictures of one size."""
    from PIL import Image

    first = Image.open(pictures[0])
    width, height = first.size
    first.close()
    given = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}", "-r", str(fps), "-i", "-"]
    suffix = path.suffix.lower()
    with output.replacing(path) as part:
        wanted = [*_COLORS, *_CODECS[suffix], "-f", suffix[1:], str(part)]
        command = [_ffmpeg(), "-y", "-loglevel", "error", *given, *wanted]
        with subprocess.Popen(command, stdin=subprocess.PIPE, stderr=subprocess.PIPE) as process:
            assert process.stdin is not None
            assert process.stderr is not None
            try:
                for picture in pictures:
                    with Image.open(picture) as image:
                        process.stdin.write(image.convert("RGB").tobytes())
                process.stdin.close()
            except BrokenPipeError:
                pass  # it says why
            problem = process.stderr.read().decode(errors="replace").strip()
        if process.returncode:
            raise OutputError(f"{path}: FFmpeg could not write the film: {problem or process.returncode}")


def _ffmpeg() -> str:
    """The program: the system's, else that of imageio-ffmpeg."""
    if found := shutil.which("ffmpeg"):
        return found
    try:
        import imageio_ffmpeg
    except ImportError:
        raise FragtracerError(
            "films need FFmpeg: install it, or type  pip install 'fragtracer[video]'; numbered pictures, as "
            "-o out.####.png, need nothing"
        ) from None
    return str(imageio_ffmpeg.get_ffmpeg_exe())
