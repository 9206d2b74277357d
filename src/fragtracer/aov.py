# SPDX-License-Identifier: MIT
"""Layers of a picture besides its radiance (arbitrary output variables): their names, their channels in a file, and
mattes as Cryptomatte has them."""

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fragtracer.errors import FragtracerError, OutputError

Floats = NDArray[np.float32]
RANKS = 6  # of a matte, two a layer


@dataclass(frozen=True)
class Aov:
    """A layer: the letters of its channels, and what it is. ``is_light``: a part of the radiance, which only a path
    tracer that was asked before can tell; ``matte``: the name of the Cryptomatte that it is."""

    channels: str
    meaning: str
    is_light: bool = False
    matte: str = ""


AOVS: Mapping[str, Aov] = {
    "albedo": Aov("RGB", "what the first surface reflects and lets through of white light; of an unlit one its colour"),
    "normal": Aov("XYZ", "unit shading normal of the first surface, out of its front, in the world"),
    "normal_camera": Aov("XYZ", "the same seen from the camera: x right, y up, z towards the viewer"),
    "depth": Aov("Z", "metres to the first surface along the axis of view; infinite where there is none"),
    "position": Aov("XYZ", "metres, of the first surface in the world; 0 where there is none"),
    "motion": Aov("XY", "pixels from here to the same point in the previous picture, x right, y up"),
    "emission": Aov("RGB", "light seen where it is emitted, the background included", is_light=True),
    "direct": Aov("RGB", "light scattered once", is_light=True),
    "indirect": Aov("RGB", "light scattered more often", is_light=True),
    "diffuse": Aov("RGB", "light whose first scattering was diffuse, or in a medium", is_light=True),
    "specular": Aov("RGB", "light whose first scattering was anything else", is_light=True),
    "direct_diffuse": Aov("RGB", "light scattered once, diffusely", is_light=True),
    "direct_specular": Aov("RGB", "light scattered once, otherwise", is_light=True),
    "indirect_diffuse": Aov("RGB", "light scattered more often, first diffusely", is_light=True),
    "indirect_specular": Aov("RGB", "light scattered more often, first otherwise", is_light=True),
    "object": Aov("RGBA", "ids of objects and the share of the pixel that is theirs", matte="CryptoObject"),
    "material": Aov("RGBA", "ids of materials and the share of the pixel that is theirs", matte="CryptoMaterial"),
    "denoising_albedo": Aov("RGB", "albedo of what is seen, also through smooth surfaces, times what they leave of it"),
    "denoising_normal": Aov("XYZ", "its shading normal, in the world"),
    "denoising_emission": Aov("RGB", "light seen where it is emitted, also through smooth surfaces; of the picture"),
    "denoising_clean_emission": Aov("RGB", "the same of more samples than the picture has"),
    "denoising_half_difference": Aov("RGB", "half the difference of the means of two halves of the samples"),
    "samples": Aov("Y", "how many finite samples the pixel has"),
    "standard_error": Aov("RGB", "of the radiance; infinite below two samples"),
}
# What a denoiser wants, in the order of its arguments (:func:`fragtracer.denoising.denoise`).
DENOISING = (*(name for name in AOVS if name.startswith("denoising_")), "standard_error")


def checked(names: Iterable[str]) -> tuple[str, ...]:
    """The layers asked for, each once; "all" are all, "denoising" those that a denoiser wants, and commas may stand
    between names.

    Raises
    ------
    FragtracerError
        If there is no such layer.
    """
    texts = [names] if isinstance(names, str) else names
    asked = [part.strip() for text in texts for part in text.split(",")]
    for name in asked:
        if name not in ("all", "denoising", *AOVS):
            raise FragtracerError(f"there is no layer {name!r}; the layers are: {', '.join(AOVS)}, or all of them: all")
    groups = {"all": tuple(AOVS), "denoising": DENOISING}
    return tuple(dict.fromkeys(one for name in asked for one in groups.get(name, (name,))))


def channels(name: str, values: ArrayLike, height: int, width: int) -> dict[str, Floats]:
    """The channels of a layer (height, width) or (height, width, n), or of a matte (height, width, 6, 2), by the names
    that they have in a file: LAYER.LETTER.

    Raises
    ------
    OutputError
        If it is of another shape.
    """
    aov, array = AOVS.get(name, Aov("RGB", "")), np.asarray(values)
    count = len(aov.channels)
    shapes = [(RANKS, 2)] if aov.matte else [(count,), *([()] if count == 1 else [])]
    if array.shape not in [(height, width, *shape) for shape in shapes] or array.dtype.kind not in "fiub":
        wanted = (height, width, *shapes[0])
        raise OutputError(f"the layer {name} is an array of {wanted} numbers here, got {array.dtype} {array.shape}")
    array = array.astype(np.float32, copy=False)
    if not aov.matte:
        planes = array.reshape(height, width, count)
        return {f"{name}.{letter}": planes[..., i] for i, letter in enumerate(aov.channels)}
    pairs = array.reshape(height, width, RANKS // 2, 4)
    return {
        f"{aov.matte}{level:02}.{letter}": pairs[:, :, level, i]
        for level in range(RANKS // 2)
        for i, letter in enumerate(aov.channels)
    }


def matte(counts: Floats, samples: Floats, names: Sequence[str]) -> Floats:
    """Ids and coverage, (height, width, 6, 2), the largest first, of ranks (height, width, 6, 2) of numbers into
    ``names``, from 1 on, and of how many of the ``samples`` (height, width) of each pixel met them."""
    ids = np.array([0.0, *map(matte_id, names)], np.float32)
    identity = ids[counts[..., 0].astype(np.int64)]
    share = counts[..., 1] / np.maximum(samples, 1)[..., None]
    for first in range(RANKS):  # what has the same name is the same
        for other in range(first + 1, RANKS):
            same = identity[..., first] == identity[..., other]
            share[..., first] += np.where(same, share[..., other], 0)
            share[..., other] *= ~same
    identity[share == 0] = 0
    order = np.argsort(-share, axis=2, kind="stable")
    return np.stack([np.take_along_axis(a, order, 2) for a in (identity, share)], axis=3).astype(np.float32)


def matte_id(name: str) -> float:
    """The id of a name: its hash, taken as a float32 that is neither denormal nor infinite nor NaN (Friedman and Jones
    2015, Fully automatic ID mattes with support for motion blur and transparency; Cryptomatte specification 1.2.0)."""
    return float(np.array(_matte_bits(name), np.uint32).view(np.float32))


def matte_metadata(name: str, names: Iterable[str]) -> dict[str, str]:
    """What the header of a file says of the matte ``name``, one of :data:`AOVS`, and of the ``names`` in it."""
    layer = AOVS[name].matte
    prefix = f"cryptomatte/{murmur3(layer.encode()):08x}"[: len("cryptomatte/") + 7]
    return {
        f"{prefix}/name": layer,
        f"{prefix}/hash": "MurmurHash3_32",
        f"{prefix}/conversion": "uint32_to_float32",
        f"{prefix}/manifest": json.dumps({one: f"{_matte_bits(one):08x}" for one in names}, separators=(",", ":")),
    }


def _matte_bits(name: str) -> int:
    bits = murmur3(name.encode())
    return bits ^ 1 << 23 if bits >> 23 & 255 in (0, 255) else bits


def murmur3(data: bytes, seed: int = 0) -> int:
    """MurmurHash3_x86_32 (Appleby 2011)."""
    mask = 0xFFFFFFFF

    def mixed(word: int) -> int:
        word = word * 0xCC9E2D51 & mask
        return (word << 15 | word >> 17) * 0x1B873593 & mask

    state, whole = seed, len(data) // 4 * 4
    for i in range(0, whole, 4):
        state ^= mixed(int.from_bytes(data[i : i + 4], "little"))
        state = (state << 13 | state >> 19) * 5 + 0xE6546B64 & mask
    state ^= mixed(int.from_bytes(data[whole:], "little")) ^ len(data)
    state = (state ^ state >> 16) * 0x85EBCA6B & mask
    state = (state ^ state >> 13) * 0xC2B2AE35 & mask
    return state ^ state >> 16
