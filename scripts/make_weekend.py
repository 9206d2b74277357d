# SPDX-License-Identifier: MIT
"""Writes scenes/weekend.toml: the final picture of "Ray Tracing in One Weekend" (Peter Shirley, Trevor David Black and
Steve Hollasch), from its description, with random numbers of our own.

usage: python scripts/make_weekend.py [FILE.toml]

A small sphere stands in each cell of a field of 22 x 22 m, away from the large ones: four in five are matte, of the
product of two random colours; three in twenty are metal, of a bright random colour and a random fuzz; one in twenty is
glass. Of each kind of surface there are a few materials, which the spheres share. The fuzz of a metal, the radius of a
sphere that its reflections are jittered by, is the GGX width here. The same file is written at every run.
"""

import argparse
from pathlib import Path

import numpy as np

from fragtracer.io.toml import save
from fragtracer.scene import Camera, Environment, Gradient, Material, Plane, RenderSettings, Scene, Sphere

FILE = Path(__file__).parents[1] / "scenes" / "weekend.toml"
MATTE, METAL = 48, 12  # materials of each kind
LARGE = {"glass": (0.0, 1.0, 0.0), "brown": (-4.0, 1.0, 0.0), "mirror": (4.0, 1.0, 0.0)}


def weekend() -> Scene:
    """The scene, the same at every call."""
    rng = np.random.default_rng(1)
    matte = {f"matte-{i}": _matte(rng.random(3) * rng.random(3)) for i in range(MATTE)}
    metal = {f"metal-{i}": _metal(0.5 + rng.random(3) / 2, rng.random() / 2) for i in range(METAL)}
    large = {"glass": Material(model="dielectric", roughness=0.0), "brown": _matte((0.4, 0.2, 0.1))}
    large |= {"mirror": _metal((0.7, 0.6, 0.5), 0.0), "ground": _matte((0.5, 0.5, 0.5))}
    spheres = [Sphere(center, 1.0, name) for name, center in LARGE.items()]
    for x in range(-11, 11):
        for z in range(-11, 11):
            chosen, (across, along) = rng.random(), rng.random(2)
            center = np.round((x + 0.9 * across, 0.2, z + 0.9 * along), 3)
            kind = matte if chosen < 0.8 else metal if chosen < 0.95 else {"glass": None}
            name = str(rng.choice(list(kind)))
            if min(np.linalg.norm(np.subtract(center, (place[0], 0.2, place[2]))) for place in LARGE.values()) > 0.9:
                spheres.append(Sphere(tuple(map(float, center)), 0.2, name))
    return Scene(
        camera=Camera((13.0, 2.0, 3.0), (0.0, 0.0, 0.0), fov_degrees=20.0, aperture_radius=0.05, focus_distance=10.0),
        materials={**large, **matte, **metal},
        spheres=spheres,
        planes=[Plane((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), "ground")],
        environment=Environment(gradient=Gradient((0.5, 0.7, 1.0), (0.75, 0.85, 1.0), (1.0, 1.0, 1.0))),
        render=RenderSettings(width=600, height=338, spp=256, bounces=50),
        name="weekend",
        description="The field of matte, metal and glass spheres of Ray Tracing in One Weekend",
    )


def _matte(color: object) -> Material:
    return Material(albedo=_rounded(color), specular=0.0)


def _metal(color: object, fuzz: float) -> Material:
    return Material(albedo=_rounded(color), metallic=1.0, roughness=round(float(np.sqrt(fuzz)), 3))


def _rounded(color: object) -> tuple[float, float, float]:
    r, g, b = np.round(np.asarray(color, np.float64), 3).tolist()
    return (r, g, b)


def main() -> None:
    parser = argparse.ArgumentParser(description="Make the field of spheres of Ray Tracing in One Weekend.")
    parser.add_argument("file", nargs="?", type=Path, default=FILE, help="the scene file to write")
    save(weekend(), parser.parse_args().file)


if __name__ == "__main__":
    main()
