# SPDX-License-Identifier: MIT
"""Denoising by Open Image Denoise (Áfra 2025): a neural network guesses the picture that more samples would have given.
It has a bias that nobody knows, so it never takes the place of the radiance (docs/denoising.md)."""

from importlib.metadata import version
from types import ModuleType
from typing import Any

import numpy as np
import numpy.typing as npt

from fragtracer.errors import FragtracerError

Floats = npt.NDArray[np.float32]
GUIDES = ("albedo", "normal")  # the layers that it wants besides the picture
_LEAST = 128  # pixels a side: the network has black around a picture, which would darken a small one
KEY = "denoised"  # of the metadata of a picture that is, and the name of the layer
LAYER_KEY = "denoised_layer"  # of the metadata of a picture that is not, but has such a layer


def denoise(image: npt.ArrayLike, albedo: npt.ArrayLike | None = None, normal: npt.ArrayLike | None = None) -> Floats:
    """A guess of the picture without noise.

    Parameters
    ----------
    image
        Linear radiance, (height, width, 3), not negative: before exposure and tone curve.
    albedo, normal
        Layers of the same picture (:meth:`fragtracer.renderer.Renderer.aov`), (height, width, 3), in [0, 1] and
        [-1, 1]: what they show is kept sharp. They are denoised first, for they have the noise of lenses and edges. A
        normal needs an albedo.

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
    images = {"color": _checked(image, "image", None)}
    for name, guide in zip(GUIDES, (albedo, normal), strict=True):
        if guide is not None:
            images[name] = _checked(guide, name, images["color"].shape)
    if "normal" in images and "albedo" not in images:
        raise FragtracerError("to denoise by a normal, an albedo is needed too")
    height, width, _ = images["color"].shape
    above, left = (max(0, _LEAST - side) // 2 for side in (height, width))
    margins = [(above, max(0, _LEAST - height - above)), (left, max(0, _LEAST - width - left)), (0, 0)]
    images = {name: np.ascontiguousarray(np.pad(one, margins, mode="edge")) for name, one in images.items()}
    with oidn.Device() as device:
        device.commit()
        _check(device)
        guides = [name for name in GUIDES if name in images]
        clean = {name: _filtered(oidn, device, {name: images[name]}, oidn.OIDN_QUALITY_BALANCED) for name in guides}
        images = {"color": images["color"], **clean}
        found = _filtered(oidn, device, images, oidn.OIDN_QUALITY_HIGH, hdr=True, cleanAux=bool(clean))
    return np.ascontiguousarray(found[above : above + height, left : left + width])


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
