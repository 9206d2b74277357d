# SPDX-License-Identifier: MIT
"""Numbers of the scene model that both the renderer and the reference take from it, so that no comparison of the two
could show an error in them: against literal values from elsewhere. Others are the sky (test_sky.py), tangents
(test_tangents.py), the fit of what a lobe reflects (shaders/test_material_figures.py) and the power of a spot light
(test_light_model.py)."""

import numpy as np
import pytest
from numpy.typing import ArrayLike, NDArray

from fragtracer.scene import Camera, Light, Material
from fragtracer.scene.reflectance import DIELECTRIC_F0, METAL_F0, grazing_reflectance, reflectance_from_ior

# Akenine-Möller et al. 2018, Real-Time Rendering, 4th edition, table 9.2: its column of 8-bit sRGB.
OF_256 = {
    "titanium": (194, 187, 179),
    "chromium": (196, 197, 196),
    "nickel": (212, 205, 192),
    "platinum": (214, 209, 201),
    "palladium": (222, 217, 211),
    "brass": (245, 228, 174),
    "zinc": (213, 234, 237),
}
# Hoffman 2010, Background: Physically-Based Shading, table 1: its column of sRGB.
OF_1 = {
    "gold": (1.00, 0.86, 0.57),
    "silver": (0.98, 0.97, 0.95),
    "copper": (0.98, 0.82, 0.76),
    "iron": (0.77, 0.78, 0.78),
    "aluminium": (0.96, 0.96, 0.97),
}
GREY_OF_1 = {
    "water": 0.15,
    "plastic": 0.21,
    "glass": 0.21,
    "plastic, high": 0.24,
    "glass, high": 0.31,
    "ruby": 0.31,
    "diamond": 0.45,
}


def linear(encoded: ArrayLike) -> NDArray[np.float64]:
    """Of sRGB (IEC 61966-2-1), above its dark end."""
    return ((np.asarray(encoded) + 0.055) / 1.055) ** 2.4


def assert_same(f0: ArrayLike, encoded: ArrayLike, digit: float, encoded_digit: float) -> None:
    """Both are what they round to."""
    low, high = (linear(np.asarray(encoded) + side * encoded_digit / 2) for side in (-1, 1))
    assert (np.asarray(f0) > low - 0.51 * digit).all()
    assert (np.asarray(f0) < high + 0.51 * digit).all()


def test_reflectance_of_metals() -> None:
    assert METAL_F0.keys() == OF_256.keys() | OF_1.keys()
    for name, encoded in OF_256.items():
        assert_same(METAL_F0[name], np.divide(encoded, 255), 0.001, 1 / 255)
    for name, values in OF_1.items():
        assert_same(METAL_F0[name], values, 0.01, 0.01)
    for name in METAL_F0:
        assert Material(metal=name).specular_f0 == METAL_F0[name]


def test_reflectance_of_dielectrics() -> None:
    assert DIELECTRIC_F0.keys() == GREY_OF_1.keys()
    for name, encoded in GREY_OF_1.items():
        assert_same(DIELECTRIC_F0[name], encoded, 0.01, 0.01)


@pytest.mark.parametrize(
    ("ior", "f0", "digit"),
    [
        (1.5, 0.04, 1e-9),  # Hecht 2017, Optics, 5th edition, section 4.6.3: glass, 4 %
        (4.0, 0.36, 1e-9),  # (3 / 5)²
        (1.333, 0.02, 0.01),  # water, ruby and diamond: Hoffman 2010, table 1
        (1.77, 0.08, 0.01),
        (2.417, 0.172, 0.001),  # diamond: Akenine-Möller et al. 2018, table 9.4
        (1.0, 0.0, 1e-9),
    ],
)
def test_reflectance_of_an_index_of_refraction(ior: float, f0: float, digit: float) -> None:
    assert reflectance_from_ior(ior) == pytest.approx(f0, abs=digit / 2)
    assert Material(ior=ior).specular_f0 == pytest.approx((f0,) * 3, abs=digit / 2)


def test_reflectance_at_grazing_incidence() -> None:
    """Full from the reflectance of water on (Lagarde and de Rousiers 2014, section 3.1.2)."""
    assert [grazing_reflectance(f0) for f0 in (0.0, 0.005, 0.02, 0.5, 1.0)] == [0, 0.25, 1, 1, 1]
    half = Material(albedo=(1.0, 0.5, 0.0), f0=(0.01, 0.04, 0.0), metallic=0.5, specular=0.4)
    np.testing.assert_allclose(half.specular_f0, (0.502, 0.258, 0.0))
    np.testing.assert_allclose(half.specular_f90, (0.6, 0.7, 0.5))


def test_radiance_of_a_power() -> None:
    """Of a Lambertian emitter, power = pi area radiance; of an isotropic point, power = 4 pi intensity (Pharr, Jakob
    and Humphreys 2023, Physically Based Rendering, 4th edition, sections 12.2 and 12.4)."""
    lamp = Light((0.0, 0.0, 0.0), 0.1, power=(10.0, 0.0, 1.0))  # 0.125664 m²
    np.testing.assert_allclose(lamp.surface_radiance, (25.3303, 0, 2.53303), rtol=1e-5)
    point = Light((0.0, 0.0, 0.0), power=(10.0, 0.0, 1.0))
    np.testing.assert_allclose(point.intensity, (0.795775, 0, 0.0795775), rtol=1e-5)


def test_focal_distance() -> None:
    """Along the axis to the target, unless it is given."""
    assert Camera((1.0, 2.0, 3.0), (4.0, 6.0, 15.0)).focal_distance == pytest.approx(13)
    assert Camera((1.0, 2.0, 3.0), (4.0, 6.0, 15.0), focus_distance=0.3).focal_distance == 0.3
