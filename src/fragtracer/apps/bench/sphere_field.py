# SPDX-License-Identifier: MIT
"""The scene sphere-field with any number of spheres, each with a material of its own, on a plane under a sky.

After the final picture of Peter Shirley, "Ray Tracing in One Weekend" (camera, sky and the three large spheres are
those of the book), without its glass. A field of any number of spheres covers the same square of 22 m: the spheres
become smaller.
"""

import math
import random

from fragtracer.scene import Camera, Environment, Gradient, Material, Plane, RenderSettings, Scene, Sphere

SPHERES = 480  # of the scene sphere-field
_SEED = 20201207
_HALF = 11.0  # of the side of the square, metres
_RADIUS = 0.22  # of a small sphere, in cells
_LARGE = {
    "large-matte": (Sphere((-4.0, 1.0, 0.0), 1.0, "large-matte"), Material(albedo=(0.4, 0.2, 0.1), specular=0.0)),
    "large-plastic": (Sphere((0.0, 1.0, 0.0), 1.0, "large-plastic"), Material(albedo=(0.1, 0.3, 0.35), roughness=0.1)),
    "large-metal": (
        Sphere((4.0, 1.0, 0.0), 1.0, "large-metal"),
        Material(albedo=(0.7, 0.6, 0.5), metallic=1.0, roughness=0.05),
    ),
}


def sphere_field(count: int) -> Scene:
    """The scene of ``count`` spheres, at least those that are large."""
    spheres, materials = [sphere for sphere, _ in _LARGE.values()], {name: item for name, (_, item) in _LARGE.items()}
    if count < len(spheres):
        raise ValueError(f"there are {len(spheres)} large spheres already; give a number from there on")
    rng = random.Random(_SEED)
    for index, (x, z, radius) in enumerate(_places(count - len(spheres))):
        name = f"{index:0{len(str(count))}}"
        materials[name] = _material(rng)
        spheres.append(Sphere((x, radius, z), radius, name))
    materials["ground"] = Material(albedo=(0.5,) * 3, specular=0.0)
    return Scene(
        camera=Camera((13.0, 2.0, 3.0), (0.0, 0.0, 0.0), fov_degrees=20.0, aperture_radius=0.05, focus_distance=10.0),
        materials=materials,
        spheres=tuple(spheres),
        planes=(Plane((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), "ground"),),
        environment=Environment(
            gradient=Gradient(zenith=(0.5, 0.7, 1.0), horizon=(0.75, 0.85, 1.0), ground=(1.0,) * 3)
        ),
        render=RenderSettings(width=480, height=270, bounces=10),
        description=f"A field of {count:,} spheres, each with a material of its own: matte, metal or plastic",
    )


def _places(count: int) -> list[tuple[float, float, float]]:
    """x, z and radius of ``count`` small spheres that touch neither each other nor a large one."""
    cells = math.isqrt(count)
    places: list[tuple[float, float, float]] = []
    while len(places) < count:
        cells += 1
        places = _grid(cells)
    return places[:count]


def _grid(cells: int) -> list[tuple[float, float, float]]:
    """A sphere in each of ``cells`` x ``cells`` squares but those at a large one, the nearest to the camera first."""
    rng, side = random.Random(_SEED), 2 * _HALF / cells
    radius = round(_RADIUS * side, 4)
    free = side - 2 * radius - 1e-3
    places = []
    for row in range(cells - 1, -1, -1):
        for column in range(cells):
            x = round(-_HALF + row * side + radius + free * rng.random(), 4)
            z = round(-_HALF + column * side + radius + free * rng.random(), 4)
            if all(
                math.dist((x, radius, z), large.center) > 1.05 * (radius + large.radius) for large, _ in _LARGE.values()
            ):
                places.append((x, z, radius))
    return places


def _material(rng: random.Random) -> Material:
    """Half of them matte, a quarter metal and a quarter plastic, in random colours."""
    kind = rng.random()
    if kind < 0.5:
        return Material(albedo=_saturated(rng), specular=0.0)
    if kind < 0.75:
        r, g, b = (round(rng.uniform(0.5, 0.95), 3) for _ in range(3))
        return Material(albedo=(r, g, b), metallic=1.0, roughness=round(rng.uniform(0.02, 0.6), 3))
    return Material(albedo=_saturated(rng), roughness=round(rng.uniform(0.05, 0.4), 3))


def _saturated(rng: random.Random) -> tuple[float, float, float]:
    r, g, b = (round(0.02 + 0.93 * rng.random() * rng.random(), 3) for _ in range(3))
    return (r, g, b)
