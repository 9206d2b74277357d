# SPDX-License-Identifier: MIT
"""Samplers follow their pdf: a chi² test in coordinates in which it is uniform."""

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fragtracer.apps.doctor import Finding
from fragtracer.gpu.specialise import Specialisation
from fragtracer.packing.records import BsdfModel
from fragtracer.probe import probe

_LIBRARY = ["core/warp.glsl", "bsdf/bsdf.glsl"]
_ROWS, _CELLS = 2**19, 16
_LEVEL = 1e-4  # of each test
# Of the three materials of _energy, seen under cos = 0.8, by 2000 x 2000 points of float64 quadrature.
_REFLECTED = (1.0, 0.52086, 0.92532)

# GLSL that samples a point from u, and its height and azimuth in [0, 1), uniform if the sampler is right.
_AZIMUTH = "fract(atan(v.y, v.x) / (2.0 * PI) + 1.0)"
_SAMPLERS = {
    "cosine hemisphere": ("vec3 v = square_to_cosine_hemisphere(u);", "dot(v.xy, v.xy)"),
    "sphere": ("vec3 v = square_to_uniform_sphere(u);", "0.5 - 0.5 * v.z"),
    "cone of a light": ("vec3 v = square_to_uniform_cone(u, 0.01);", "dot(v.xy, v.xy) / (1.0 + v.z) / 0.01"),
    "disk of the lens": ("vec2 v = square_to_disk(u);", "dot(v, v)"),
    # Seen along the normal, tan² / (alpha² + tan²) of a GGX normal is uniform.
    "GGX normals, alpha 0.001": (
        "vec3 v = ggx_sample_vndf(1e-3, vec3(0.0, 0.0, 1.0), u);",
        "dot(v.xy, v.xy) / (1e-6 * v.z * v.z + dot(v.xy, v.xy))",
    ),
    "GGX normals, alpha 0.5": (
        "vec3 v = ggx_sample_vndf(0.5, vec3(0.0, 0.0, 1.0), u);",
        "dot(v.xy, v.xy) / (0.25 * v.z * v.z + dot(v.xy, v.xy))",
    ),
}


def findings(context: Any) -> Iterator[Finding]:
    rng = np.random.default_rng(2)
    for name, (sample, height) in _SAMPLERS.items():
        u = rng.integers(0, 2**23, (_ROWS, 2)).astype(np.float32) * np.float32(2**-23)
        found = probe(context, _LIBRARY, f"{sample} c = vec2({height}, {_AZIMUTH});", {"u": u}, {"c": 2})
        p = _uniform(found["c"].astype(np.float64))
        yield Finding("samplers", name, p >= _LEVEL, f"p = {p:.2g}")
    yield _energy(context, u)


def _uniform(points: NDArray[np.float64]) -> float:
    cells = np.clip(np.floor(points * _CELLS), 0, _CELLS - 1)
    counts = np.bincount((cells[:, 0] * _CELLS + cells[:, 1]).astype(int), minlength=_CELLS**2)
    expected = len(points) / _CELLS**2
    return _chi_square_tail(float(((counts - expected) ** 2 / expected).sum()), _CELLS**2 - 1)


def _chi_square_tail(x: float, degrees: int) -> float:
    """Wilson and Hilferty 1931, The Distribution of Chi-Square."""
    deviate = ((x / degrees) ** (1 / 3) - (1 - 2 / (9 * degrees))) / math.sqrt(2 / (9 * degrees))
    return 0.5 * math.erfc(deviate / math.sqrt(2))


def _energy(context: Any, u: NDArray[np.float32]) -> Finding:
    """The albedo of a smooth white metal, a rough one and a white dielectric agrees with float64 quadrature."""
    body = """
        vec3 wo = normalize(vec3(0.6, 0.0, 0.8));
        Bsdf lobe = bsdf_of(BSDF_COOK_TORRANCE, vec3(0.0), 1e-3, vec3(1.0), vec3(1.0));
        BsdfSample a = bsdf_sample(lobe, wo, u);
        lobe.alpha = 0.7;
        BsdfSample b = bsdf_sample(lobe, wo, u);
        lobe.diffuse = vec3(1.0);
        lobe.alpha = 0.2;
        lobe.f0 = vec3(0.04);
        BsdfSample c = bsdf_sample(lobe, wo, u);
        w = vec3(a.weight.x, b.weight.x, c.weight.x);"""
    others = sum(1 << model for model in BsdfModel if model is not BsdfModel.COOK_TORRANCE)
    constants = Specialisation({"u_absent_models": others, "u_without_iridescence": 1, "u_without_sheen": 1})
    found = probe(context, _LIBRARY, body, {"u": u}, {"w": 3}, text_pass=constants.apply)
    weights = found["w"].astype(np.float64)
    error = 4 * weights.std(0) / np.sqrt(_ROWS) + 1e-3
    right = bool((np.abs(weights.mean(0) - _REFLECTED) < error).all())
    return Finding(
        "samplers", "energy of the material", right, f"{weights.mean(0).round(4).tolist()} of {list(_REFLECTED)}"
    )
