# SPDX-License-Identifier: MIT
"""Writes scenes/spheres-49.toml, the demonstration of image-based lighting, and the meshes it needs.

usage: python scripts/pbr_demo.py

Seven by seven spheres over roughness and metallic, a sphere with textures, and three models, made here: a knot, a
turned vase and a shell. The sky is clear; its sun is 6° in radius, so that pictures of all this polish do not take
millions of samples.
"""

from pathlib import Path

import numpy as np

from fragtracer.io.toml import save
from fragtracer.scene import (
    Camera,
    Environment,
    Geometry,
    Image,
    Material,
    Mesh,
    Part,
    Placement,
    RenderSettings,
    Scene,
    Sky,
    Sphere,
    Texture,
)

SCENES = Path(__file__).parents[1] / "scenes"
NAME = "spheres-49"
STEPS = 7


def grid(u_steps: int, v_steps: int, point: object) -> Geometry:
    """The surface point(u, v), both from 0 to 1, smooth, with u and v as texture coordinates."""
    u, v = np.meshgrid(np.linspace(0, 1, u_steps + 1), np.linspace(0, 1, v_steps + 1))
    step = 1e-4
    positions = point(u, v)  # type: ignore[operator]
    normals = np.cross(
        point(u + step, v) - point(u - step, v),  # type: ignore[operator]
        point(u, v + step) - point(u, v - step),  # type: ignore[operator]
    )
    length = np.linalg.norm(normals, axis=-1, keepdims=True)
    normals = np.where(length > 1e-12, normals / np.maximum(length, 1e-12), positions - positions.mean((0, 1)))
    corner = (np.arange(v_steps)[:, None] * (u_steps + 1) + np.arange(u_steps)).ravel()
    a, b, c, d = corner, corner + 1, corner + u_steps + 2, corner + u_steps + 1
    triangles = np.concatenate([np.stack([a, b, c], -1), np.stack([a, c, d], -1)])
    flat = positions.reshape(-1, 3).astype(np.float32)
    area = np.linalg.norm(np.cross(*(flat[triangles[:, i]] - flat[triangles[:, 0]] for i in (1, 2))), axis=1)
    uvs = np.stack([u, 1 - v], axis=-1).reshape(-1, 2)
    return Geometry(flat, triangles[area > 1e-10], normals=normals.reshape(-1, 3), uvs=uvs)


def ball(u: np.ndarray, v: np.ndarray) -> np.ndarray:
    theta, phi = np.pi * (1 - v), 2 * np.pi * u
    return np.stack([np.sin(theta) * np.sin(phi), np.cos(theta), np.sin(theta) * np.cos(phi)], axis=-1)


def knot(u: np.ndarray, v: np.ndarray) -> np.ndarray:
    """A tube around a trefoil."""
    t = 2 * np.pi * u
    middle = np.stack([np.sin(t) + 2 * np.sin(2 * t), np.cos(t) - 2 * np.cos(2 * t), -np.sin(3 * t)], axis=-1)
    along = np.stack([np.cos(t) + 4 * np.cos(2 * t), -np.sin(t) + 4 * np.sin(2 * t), -3 * np.cos(3 * t)], axis=-1)
    along /= np.linalg.norm(along, axis=-1, keepdims=True)
    across = np.cross(along, np.array([0.0, 0.0, 1.0]))
    across /= np.linalg.norm(across, axis=-1, keepdims=True)
    turn = 2 * np.pi * v[..., None]
    return (middle + 0.55 * (np.cos(turn) * across + np.sin(turn) * np.cross(along, across))) / 3.2


def vase(u: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Turned on a lathe, with flutes that wind around the belly; open above, its wall thick."""
    outside = np.clip(v / 0.6, 0, 1)
    inside = np.clip((v - 0.6) / 0.4, 0, 1)
    height = np.where(v < 0.6, outside, 1 - 0.9 * inside)
    profile = 0.34 + 0.3 * np.sin(np.pi * height**0.8) - 0.2 * height + 0.18 * height**6
    phi = 2 * np.pi * u
    flutes = 0.02 * np.sin(12 * phi + 5 * height) * np.sin(np.pi * height) ** 2
    radius = np.where(v < 0.6, profile + flutes, profile - 0.05 * np.minimum(1, 8 * inside))
    closing = np.minimum(1, np.minimum(v / 0.03, (1 - v) / 0.03))
    return np.stack([radius * closing * np.sin(phi), 2 * height - 1, radius * closing * np.cos(phi)], axis=-1)


def shell(u: np.ndarray, v: np.ndarray) -> np.ndarray:
    """A tube that grows along a spiral, ribbed as snails' are."""
    turns = 2 * np.pi * 2.6 * v
    size = np.exp(0.19 * turns) / np.exp(0.19 * 2 * np.pi * 2.6)
    around = 2 * np.pi * u
    ribs = 1 + 0.03 * np.sin(24 * turns)
    radius = 0.5 + 0.42 * ribs * np.cos(around)
    height = 0.9 - 1.5 * size + 0.42 * ribs * size * np.sin(around)
    return np.stack([size * radius * np.cos(turns), height, -size * radius * np.sin(turns)], axis=-1)


def tiles(name: str, color_space: str) -> Texture:
    from PIL import Image as Pictures

    file = SCENES / "textures" / f"tiles_{name}.png"
    picture = Image(np.asarray(Pictures.open(file)), color_space, str(file))  # type: ignore[arg-type]
    return Texture(picture, scale=(4.0, 2.0))


def scene() -> Scene:
    materials = {}
    spheres = []
    for row in range(STEPS):
        for column in range(STEPS):
            name = f"metallic-{row}-roughness-{column}"
            roughness, metallic = column / (STEPS - 1), row / (STEPS - 1)
            materials[name] = Material(albedo=(0.85, 0.25, 0.15), roughness=roughness, metallic=metallic)
            spheres.append(Sphere((1.2 * (column - 3), 1.2 * (row - 3), 0.0), 0.5, name))
    materials["tiles"] = Material(
        albedo=1.0,
        roughness=1.0,
        albedo_texture=tiles("albedo", "srgb"),
        roughness_texture=tiles("roughness", "linear"),
        normal_texture=tiles("normal", "linear"),
    )
    materials |= {
        "gold": Material(metal="gold", roughness=0.25),
        "glaze": Material(albedo=(0.05, 0.25, 0.35), roughness=0.15),
        "pearl": Material(albedo=(0.85, 0.8, 0.75), roughness=0.4),
    }
    shapes = {"tiles": grid(48, 24, ball), "gold": grid(120, 14, knot), "glaze": grid(96, 32, vase)}
    shapes["pearl"] = grid(18, 130, shell)
    names = {"tiles": "textured sphere", "gold": "knot", "glaze": "vase", "pearl": "shell"}
    meshes = []
    for place, (material, geometry) in enumerate(shapes.items()):
        stand = Placement((6.2, 3.9 - 2.6 * place, 0.0), (0.0, 20.0, 0.0), (1.0, 1.0, 1.0))
        meshes.append(Mesh((Part(geometry, material),), (stand,), name=names[material]))
    return Scene(
        camera=Camera((1.4, 0.0, 19.0), (1.4, 0.0, 0.0), fov_degrees=30.0),
        materials=materials,
        spheres=tuple(spheres),
        meshes=tuple(meshes),
        environment=Environment(
            sky=Sky(sun_elevation_degrees=35.0, sun_azimuth_degrees=150.0, sun_radius_degrees=6.0), strength=0.02
        ),
        render=RenderSettings(width=960, height=640),
        name=NAME,
        description="The demonstration of image-based lighting: 49 spheres over roughness and metallic, four models",
    )


def main() -> None:
    """Save the scene, its meshes in a folder of their own and without digests in their names."""
    path = SCENES / f"{NAME}.toml"
    save(scene(), path)
    text = path.read_text("utf-8")
    (SCENES / "meshes").mkdir(exist_ok=True)
    for file in SCENES.glob(f"{NAME}-*.npz"):
        place = f"meshes/{file.stem.rpartition('-')[0]}.npz"
        text = text.replace(file.name, place)
        file.replace(SCENES / place)
    path.write_text(text, "utf-8", newline="\n")


if __name__ == "__main__":
    main()
