# SPDX-License-Identifier: MIT
"""Image files: radiance as numbers (.exr, .hdr, .npy), or tone mapped for display (.png).

Images are (height, width, 3) float32 arrays of linear Rec. 709 radiance, row 0 at the top.

Pixels that are NaN or infinite are never hidden. OpenEXR and NumPy files store them as they are. Radiance and PNG files
cannot: there they become magenta, as bright as the brightest pixel, with a warning that counts them.
"""

import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Literal

import numpy as np
import numpy.typing as npt

from fragtracer import output
from fragtracer.aov import channels, matte_metadata
from fragtracer.display.look import Look
from fragtracer.display.tone import FloatImage
from fragtracer.errors import FragtracerError, OutputError
from fragtracer.io.images.formats import (
    Content,
    read_exr,
    read_hdr,
    read_npy,
    read_png,
    read_png_metadata,
    write_exr,
    write_hdr,
    write_npy,
    write_png,
)
from fragtracer.io.images.rgbe import LARGEST

_WRITERS = {".exr": write_exr, ".hdr": write_hdr, ".npy": write_npy, ".png": write_png}
_READERS = {".exr": read_exr, ".hdr": read_hdr, ".npy": read_npy, ".png": read_png}
READABLE = tuple(_READERS)
_PREFIX = "fragtracer."


def check_writable(path: str | Path) -> None:
    """Raise :class:`OutputError` if :func:`write_image` cannot write ``path``; to be called before rendering."""
    output.check_writable(path, _WRITERS)


def check_layers_writable(path: str | Path) -> None:
    """Raise :class:`OutputError` unless ``path`` is a file that can have layers; to be called before rendering."""
    if Path(path).suffix.lower() != ".exr":
        raise OutputError(f"{path}: only .exr files have layers; give {Path(path).with_suffix('.exr').name}")


def write_image(
    path: str | Path,
    image: npt.ArrayLike,
    metadata: Mapping[str, str] | None = None,
    exposure: float | Literal["auto"] = 0.0,
    tonemap: str = "linear",
    gamma: float = 1.0,
    bloom: float = 0.0,
    bloom_threshold: float = 1.0,
    bloom_alone: bool = False,
    layers: Mapping[str, npt.NDArray[np.float32]] | None = None,
    matte_names: Mapping[str, Sequence[str]] | None = None,
) -> None:
    """Write an image in the format of the extension of ``path``.

    An existing file is replaced only once the new one is complete.

    Parameters
    ----------
    path
        A .exr (float32, lossless), .hdr (Radiance, 8-bit mantissas; negative values become 0), .npy or .png file.
    image
        Linear radiance, (h, w, 3), row 0 at the top.
    metadata
        Kept under "fragtracer.KEY" and read back by :func:`read_metadata`; a .npy file has no place for them.
    exposure, tonemap, gamma, bloom, bloom_threshold, bloom_alone
        As :class:`fragtracer.display.look.Look` has them; .png only, the other formats keep the radiance itself.
    layers
        Other pictures by name, as :meth:`fragtracer.renderer.Renderer.aov` gives them, or (h, w, 3); .exr only. Their
        channels are LAYER.R, G and B of colours, LAYER.X, Y and Z of vectors, LAYER.Z of the depth, and those of
        Cryptomatte; R, G and B stay those of ``image``.
    matte_names
        The names whose ids mattes among the ``layers`` have, for the header.

    Raises
    ------
    OutputError
        If the file cannot be written, or the image or a setting is not of the kind described here.
    """
    check_writable(path)
    if layers:
        check_layers_writable(path)
    suffix = Path(path).suffix.lower()
    pixels = _as_image(image)
    planes: dict[str, npt.NDArray[np.float32]] = {}
    for name, values in (layers or {}).items():
        planes |= channels(name, values, *pixels.shape[:2])
    entries = {_PREFIX + key: value for key, value in (metadata or {}).items()}
    if suffix == ".hdr":
        bad = _non_finite(pixels, path)
        pixels = np.clip(np.where(bad[..., None], np.float32(0), pixels), 0, LARGEST)
        pixels[bad] = np.multiply((1, 0, 1), max(1, pixels.max()))
    if suffix == ".png":
        look = Look(exposure, tonemap, gamma, bloom, bloom_threshold, bloom_alone)
        entries |= {_PREFIX + key: value for key, value in look.metadata(pixels).items()}
        _non_finite(pixels, path)
        pixels = look.show(pixels)
    for name, names in (matte_names or {}).items():
        entries |= matte_metadata(name, names)
    with output.replacing(path) as part:
        if layers:
            write_exr(part, pixels, entries, planes)
        else:
            _WRITERS[suffix](part, pixels, entries)


def _non_finite(image: FloatImage, path: str | Path) -> npt.NDArray[np.bool_]:
    """The mask of the pixels that are NaN or infinite, with a warning if there are any."""
    bad: npt.NDArray[np.bool_] = np.logical_not(np.isfinite(image).all(axis=2))
    if bad.any():
        warnings.warn(f"{path}: {bad.sum()} pixels are NaN or infinite and are drawn magenta", stacklevel=3)
    return bad


def _as_image(image: npt.ArrayLike) -> FloatImage:
    array = np.asarray(image)
    if array.ndim != 3 or array.shape[2] != 3 or array.size == 0 or array.dtype.kind not in "fiu":
        raise OutputError(f"an image is an array of (height, width, 3) numbers, got {array.dtype} {array.shape}")
    return np.ascontiguousarray(array, dtype=np.float32)


def read_image(path: str | Path) -> FloatImage:
    """Read an image in one of the formats of :func:`write_image`.

    Returns
    -------
    numpy.ndarray
        (h, w, 3) float32, row 0 at the top. Of an .exr file the R, G and B channels of the first part, decoded
        luminance and chroma, or a single channel as grey; of an 8-bit .png file the decoded sRGB values, still with
        exposure and tone curve.

    Raises
    ------
    FragtracerError
        If the file is missing, damaged, or holds something else.
    """
    return read_content(path)[0]


def read_texels(path: str | Path) -> FloatImage:
    """As :func:`read_image`, but (h, w, 4) of an .exr file that has alpha. The colours are not divided by it."""
    return _read(path, alpha=True)[0]


def read_layers(path: str | Path, layers: Sequence[str]) -> tuple[list[FloatImage], dict[str, str]]:
    """The image and some ``layers`` of three channels of an .exr file, each (h, w, 3), and the metadata.

    Raises
    ------
    FragtracerError
        As :func:`read_image`, and if there is no such layer.
    """
    if Path(path).suffix.lower() != ".exr":
        raise FragtracerError(f"{path}: only .exr files have layers; this one has no {' or '.join(layers)}")
    pixels, entries = _read(path, layers)
    return np.split(pixels, 1 + len(layers), axis=2), _ours(entries)


def read_metadata(path: str | Path) -> dict[str, str]:
    """The metadata that :func:`write_image` stored in a file, perhaps none. Raises as :func:`read_image`, and of a .png
    file also where a checksum is wrong."""
    if Path(path).suffix.lower() != ".png":
        return read_content(path)[1]
    with _reading(path):
        return _ours(read_png_metadata(Path(path)))


def read_content(path: str | Path) -> Content:
    """The results of :func:`read_image` and :func:`read_metadata`, reading the file once. Raises as these."""
    pixels, entries = _read(path)
    return pixels, _ours(entries)


def _ours(entries: Mapping[str, str]) -> dict[str, str]:
    return {k.removeprefix(_PREFIX): value for k, value in entries.items() if k.startswith(_PREFIX)}


def check_regular(path: str | Path) -> None:
    """Raise OSError if ``path`` exists but is not a regular file: reading a pipe or a device may never end."""
    if Path(path).exists() and not Path(path).is_file():
        raise OSError("it is not a regular file")


def _read(path: str | Path, layers: Sequence[str] = (), alpha: bool = False) -> Content:
    reader = _READERS.get(Path(path).suffix.lower())
    if reader is None:
        raise FragtracerError(f"{path}: cannot read this kind of image; choose from {', '.join(_READERS)}")
    with _reading(path):
        return read_exr(Path(path), layers, alpha) if reader is read_exr else reader(Path(path))


@contextmanager
def _reading(path: str | Path) -> Iterator[None]:
    """Makes one FragtracerError of what may go wrong with a file."""
    try:
        check_regular(path)
        Path(path).open("rb").close()
        yield
    except (OSError, RuntimeError, ValueError, EOFError) as error:
        if isinstance(error, OSError) and error.strerror:
            raise FragtracerError(f"{path}: cannot read: {error.strerror}") from error
        raise FragtracerError(f"{path}: this {Path(path).suffix} file is damaged or not one: {error}") from error
