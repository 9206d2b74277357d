# SPDX-License-Identifier: MIT
"""Denoising by Open Image Denoise (Áfra 2025): a neural network guesses the picture that more samples would have given.
It has a bias that nobody knows, so it never takes the place of the radiance (docs/denoising.md)."""

from collections.abc import Sequence
from importlib.metadata import version
from types import ModuleType
from typing import Any

import numpy as np
import numpy.typing as npt
from numpy.typing import NDArray

from fragtracer.errors import FragtracerError
from fragtracer.sampling.pixels import around, bright

Floats = npt.NDArray[np.float32]
_GUIDES = ("albedo", "normal")
_PAIRS = (("emission", "clean_emission"), ("half_difference", "standard_error"))
_MARGIN = 32  # pixels of the picture mirrored around it, since the network has black there
_LEAST = 128  # pixels a side
_TURNS = ((1, 1), (-1, -1), (1, -1), (-1, 1))  # steps along the columns and rows of a picture and its mirror images
_SQUARE = 21  # pixels a side, over which the error of a denoised picture is averaged
KEY = "denoised"  # of the metadata of a picture that is, and the name of the layer
LAYER_KEY = "denoised_layer"  # of the metadata of a picture that is not, but has such a layer


def denoise(
    image: npt.ArrayLike,
    albedo: npt.ArrayLike | None = None,
    normal: npt.ArrayLike | None = None,
    emission: npt.ArrayLike | None = None,
    clean_emission: npt.ArrayLike | None = None,
    half_difference: npt.ArrayLike | None = None,
    standard_error: npt.ArrayLike | None = None,
) -> Floats:
    """A guess of the picture without noise.

    It is the mean of what the network makes of mirror images, whose errors differ (as Lim et al. 2017, Enhanced Deep
    Residual Networks for Single Image Super-Resolution, section 3.4).

    Parameters
    ----------
    image
        Linear radiance, (height, width, 3), not negative: before exposure and tone curve.
    albedo, normal
        Layers of the same picture (:meth:`fragtracer.renderer.Renderer.aov`): ``denoising_albedo`` and
        ``denoising_normal``, or those of the first surface; (height, width, 3), in [0, 1] and [-1, 1]. What they show
        is kept sharp. They are denoised first, for they have the noise of lenses and edges. A normal needs an albedo.
    emission, clean_emission
        ``denoising_emission``, a part of the image, and ``denoising_clean_emission``, the same with less noise, which
        takes its place and is not denoised. One needs the other.
    half_difference, standard_error
        ``denoising_half_difference`` and that of the image: by two independent halves of the samples it is estimated
        how wrong the guess is, and the image is mixed in where it is better. One needs the other. An infinite standard
        error, of a single sample, says nothing.

    Returns
    -------
    numpy.ndarray
        (height, width, 3) float32 linear radiance.

    Raises
    ------
    FragtracerError
        If Open Image Denoise is not installed or fails, or an array has another shape, or numbers that are not finite.
    """
    oidn = _library()
    color = _checked(image, "image", None)
    given = {"albedo": albedo, "normal": normal, "emission": emission, "clean_emission": clean_emission}
    finite = None if standard_error is None else np.nan_to_num(standard_error, nan=np.nan, posinf=-1.0)
    given |= {"half_difference": half_difference, "standard_error": finite}
    layers = {name: _checked(one, name, color.shape) for name, one in given.items() if one is not None}
    for name, other in (("normal", "albedo"), *_PAIRS, *(pair[::-1] for pair in _PAIRS)):
        if name in layers and other not in layers:
            raise FragtracerError(f"to denoise by the layer {name}, {other} is needed too")
    clean = layers.get("clean_emission", np.zeros_like(color))
    rest = np.maximum(color - layers.get("emission", 0), 0)
    error = layers.get("standard_error", np.full_like(color, -1.0))
    with oidn.Device() as device:
        device.commit()
        _check(device)
        guides = {name: _padded(layers[name]) for name in _GUIDES if name in layers}
        guides = {
            name: _filtered(oidn, device, {name: guide}, oidn.OIDN_QUALITY_BALANCED) for name, guide in guides.items()
        }

        def guess(noisy: Floats, turns: Sequence[tuple[int, int]]) -> Floats:
            images = {"color": _padded(np.maximum(noisy, 0)), **guides}
            found = np.zeros_like(images["color"])
            for down, along in turns:
                turned = {name: np.ascontiguousarray(one[::down, ::along]) for name, one in images.items()}
                clear = _filtered(oidn, device, turned, oidn.OIDN_QUALITY_HIGH, hdr=True, cleanAux=bool(guides))
                found += clear[::down, ::along] / len(turns)
            height, width, _ = noisy.shape
            return found[_MARGIN : _MARGIN + height, _MARGIN : _MARGIN + width]

        denoised = guess(rest, _TURNS) + clean
        if (error >= 0).all():
            half = layers["half_difference"]
            halves = [(rest + sign * half, guess(rest + sign * half, _TURNS[:2])) for sign in (1, -1)]
            denoised += _share(denoised, halves, error)[..., None] * (rest + clean - denoised)
    return np.ascontiguousarray(denoised, np.float32)


def _share(denoised: Floats, halves: list[tuple[Floats, Floats]], standard_error: Floats) -> NDArray[np.float64]:
    """What share the noisy picture is to have in a mixture with the ``denoised`` one, (height, width), for the least
    error, if the errors of the two are independent. ``halves`` are noisy and denoised pictures of half of the samples.

    The error of a denoised half is found by the other half, whose noise it does not know (as Rousselle et al. 2012,
    Adaptive Rendering with Non-Local Means Filtering, and Zheng et al. 2021, Ensemble Denoising for Monte Carlo
    Renderings). It is averaged over a square, and counts as far as it is more than twice its own standard error.
    """
    brightness = around(bright(denoised), 5)[..., None]
    brightness = np.where(brightness > 0, brightness, 1.0)
    (a, of_a), (b, of_b) = ([one / brightness for one in half] for half in halves)
    noisy, clear = (a + b) / 2, (of_a + of_b) / 2
    error = (a * b - (b * of_a + a * of_b) / 2 + clear * (clear - noisy)).mean(axis=2)
    variance = ((standard_error / brightness) ** 2).mean(axis=2)
    # A pixel that rare bright light has not met is too dark and shows too little variance: those around it know better.
    variance = np.maximum(variance, np.maximum(around(variance, 3), around(variance, _SQUARE)))
    weight = 1 / (variance + 0.05 * np.median(variance) + 1e-4)
    total = around(weight, _SQUARE)
    deviation = np.sqrt(around((error * weight) ** 2, _SQUARE)) / (_SQUARE * total)
    error = np.maximum(around(error * weight, _SQUARE) / total - 2 * deviation, 0)
    return np.asarray(error / (error + variance + 1e-12))


def _padded(image: Floats) -> Floats:
    """With margins that mirror it."""
    below, right = (max(0, _LEAST - 2 * _MARGIN - side) for side in image.shape[:2])
    return np.pad(image, [(_MARGIN, _MARGIN + below), (_MARGIN, _MARGIN + right), (0, 0)], mode="symmetric")


def check_installed() -> None:
    """Raise :class:`FragtracerError` if Open Image Denoise is not installed; to be called before rendering."""
    _library()


def denoiser() -> str:
    """What denoises, for the metadata of a picture."""
    return f"Open Image Denoise (pyoidn {version('pyoidn')}); the radiance was noisier, and without this bias"


def _library() -> ModuleType:
    try:
        import pyoidn
    except ImportError as error:
        raise FragtracerError("denoising needs Open Image Denoise; pip install 'fragtracer[denoise]'") from error
    except OSError as error:
        raise FragtracerError(f"Open Image Denoise cannot be loaded: {error}") from error
    module: ModuleType = pyoidn
    return module


def _checked(image: npt.ArrayLike, name: str, shape: tuple[int, ...] | None) -> Floats:
    array = np.asarray(image)
    if array.ndim != 3 or array.shape[2] != 3 or array.size == 0 or array.dtype.kind not in "fiu":
        raise FragtracerError(
            f"{name} is to be an array of (height, width, 3) numbers, got {array.dtype} {array.shape}"
        )
    if shape is not None and array.shape != shape:
        raise FragtracerError(f"{name} has the shape {array.shape}, the image {shape}")
    floats = np.ascontiguousarray(array, np.float32)
    bad = int(np.logical_not(np.isfinite(floats).all(axis=2)).sum())
    if bad:
        raise FragtracerError(
            f"{name}: {bad} pixels are NaN or infinite, which a denoiser would spread; mend them first"
        )
    return floats


def _filtered(oidn: ModuleType, device: Any, images: dict[str, Floats], quality: int, **switches: bool) -> Floats:
    """``images`` through the filter RT; the output has the shape of the first."""
    output = np.empty_like(next(iter(images.values())))
    with oidn.Filter(device, oidn.OIDN_FILTER_TYPE_RT) as rt:
        for name, array in {**images, "output": output}.items():
            rt.set_image(name, array, oidn.OIDN_FORMAT_FLOAT3)
        for name, value in switches.items():
            rt.set_bool(name, value)
        rt.set_quality(quality)
        rt.commit()
        rt.execute()
        _check(device)
    return output


def _check(device: Any) -> None:
    message = device.get_error()
    if message:
        raise FragtracerError(f"Open Image Denoise: {message}")
