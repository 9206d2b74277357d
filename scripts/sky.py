# SPDX-License-Identifier: MIT
"""The light of the computed sky on the ground, and of the sky of Hosek and Wilkie (2012, An Analytic Model for Full
Spectral Sky-Dome Radiance) in Mitsuba's ``sunsky``: prints the table of docs/environment.md."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from fragtracer.reference.variant import mitsuba_variant
from fragtracer.scene.sky import sky_pixels, sun_irradiance

LUMINANCE = np.array((0.2126, 0.7152, 0.0722))  # of Rec. 709
EFFICACY = 683.0  # lm/W
UNIT = 106.857  # radiance, in W/m²/sr, that ``sunsky`` calls 1
TURBIDITIES, ELEVATIONS = (2.0, 3.0, 6.0), (10, 30, 60)
ALBEDO = 0.2


def main() -> None:
    import mitsuba as mi

    elevation = np.radians(60)
    sun = EFFICACY * float(sun_irradiance(3.0, elevation) @ LUMINANCE) / 1000
    diffuse = EFFICACY * float(ours(3.0, elevation) @ LUMINANCE) / 1000
    print(f"Turbidity 3, sun at 60°: {sun:.0f} klx from the sun, {diffuse:.0f} klx from the sky.\n")
    print("| sun | green, ours / theirs | blue over red, ours | theirs |")
    print("|---|---|---|---|")
    for degrees in ELEVATIONS:
        pairs = [(ours(t, np.radians(degrees)), theirs(mi, t, np.radians(degrees))) for t in TURBIDITIES]
        columns = (
            [a[1] / b[1] for a, b in pairs],
            [a[2] / a[0] for a, _ in pairs],
            [b[2] / b[0] for _, b in pairs],
        )
        print(f"| {degrees}° | " + " | ".join(", ".join(f"{x:.2f}" for x in column) for column in columns) + " |")


def ours(turbidity: float, elevation: float) -> NDArray[np.float64]:
    """Irradiance of the ground by the computed sky, W/m² as Rec. 709 (3,)."""
    pixels = sky_pixels(turbidity, elevation, 0.0, ALBEDO).astype(np.float64)
    theta = np.pi * (np.arange(len(pixels)) + 0.5) / len(pixels)
    weight = np.maximum(0, np.cos(theta)) * np.sin(theta) * 2 * np.pi**2 / (pixels.shape[0] * pixels.shape[1])
    return np.asarray((pixels * weight[:, None, None]).sum((0, 1)))


def theirs(mi: Any, turbidity: float, elevation: float) -> NDArray[np.float64]:
    """The same by Mitsuba's sky, over directions that are spaced evenly in the projected solid angle; z is up."""
    import drjit as dr

    side = 512
    u, v = (np.ravel(x) for x in np.meshgrid(*2 * [(np.arange(side) + 0.5) / side]))
    radius, phi = np.sqrt(u), 2 * np.pi * v
    directions = np.stack([radius * np.cos(phi), radius * np.sin(phi), np.sqrt(1 - u)]).astype(np.float32)
    sun = [float(np.cos(elevation)), 0.0, float(np.sin(elevation))]
    settings = {"turbidity": turbidity, "sun_direction": sun, "sun_scale": 0.0, "albedo": ALBEDO}
    emitter = mi.load_dict({"type": "sunsky", **settings})
    seen = dr.zeros(mi.SurfaceInteraction3f, side * side)
    seen.wi = -mi.Vector3f(*directions)
    return np.asarray(UNIT * np.pi * np.array(emitter.eval(seen)).mean(axis=-1), np.float64)


if __name__ == "__main__":
    with mitsuba_variant("llvm_ad_rgb"):
        main()
