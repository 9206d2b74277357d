# SPDX-License-Identifier: MIT
"""Sidecar files of a scene file: meshes, images and environment maps that were made in Python."""

import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fragtracer import output
from fragtracer.io import read_model
from fragtracer.io.arrays import write_arrays
from fragtracer.io.images import write_image
from fragtracer.io.toml.meshes import Models, has_triangles, is_stored
from fragtracer.scene import Density, Environment, Image, Material, Medium, Mesh, Panorama, Scene
from fragtracer.scene.content import content_digest


def with_files(scene: Scene, path: Path) -> Scene:
    """``scene`` with a file for each mesh, image and map; those without one are written beside ``path``. Meshes without
    triangles, which no model file holds, are left out.

    Their names hold a digest of the content, so that unchanged ones are not written again.

    Raises
    ------
    OutputError
        If a file cannot be written.
    """
    models = Models()
    shown = filter(has_triangles, scene.meshes)
    meshes = tuple(mesh if is_stored(mesh, models) else _write_mesh(mesh, path) for mesh in shown)
    came = _materials_of(meshes)
    materials = {
        name: material if came.get(name) == material else _with_images(material, path)
        for name, material in scene.materials.items()
    }
    media = {name: _with_density(medium, path) for name, medium in scene.media.items()}
    environment = _with_panorama(scene.environment, path)
    return replace(scene, meshes=meshes, materials=materials, media=media, environment=environment)


def _materials_of(meshes: tuple[Mesh, ...]) -> Mapping[str, Material]:
    models, found = Models(), {}
    for mesh in meshes:
        assert mesh.file is not None
        found.update(models.get(mesh.file, mesh.pose).materials)
    return found


def _write_mesh(mesh: Mesh, path: Path) -> Mesh:
    parts = [(part.geometry.digest, part.material, repr(part.matrix)) for part in mesh.parts]
    file = _beside(path, mesh.name, content_digest(repr(parts)), ".npz")
    if not file.exists():
        with output.replacing(file) as part:
            write_arrays(part, mesh)
    return replace(read_model(file).mesh, name=mesh.name, material=mesh.material, instances=mesh.instances)


def _with_images(material: Material, path: Path) -> Material:
    changes: dict[str, Any] = {}
    for name, texture in material.textures.items():
        if texture.image.file is None:
            changes[f"{name}_texture"] = replace(texture, image=_write_image(texture.image, name, path))
    return replace(material, **changes)


def _with_density(medium: Medium, path: Path) -> Medium:
    if medium.density is None or medium.density.file is not None:
        return medium
    file = _beside(path, "density", medium.density.digest, ".npy")
    if not file.exists():
        with output.replacing(file) as part:
            _write_array(part, medium.density.values)
    return replace(medium, density=Density(medium.density.values, str(file)))


def _with_panorama(environment: Environment | None, path: Path) -> Environment | None:
    if environment is None or environment.image is None or environment.image.file is not None:
        return environment
    image = environment.image
    file = _beside(path, "environment", image.digest, ".exr")
    if not file.exists():
        write_image(file, image.pixels)
    return replace(environment, image=Panorama(image.pixels, str(file)))


def _write_image(image: Image, name: str, path: Path) -> Image:
    pixels, channels = image.pixels, image.pixels.shape[2]
    suffix = ".png" if pixels.dtype == np.uint8 else ".exr" if channels == 3 else ".npy"
    file = _beside(path, name, image.digest, suffix)
    if suffix == ".exr" and not file.exists():
        write_image(file, pixels)
    elif not file.exists():
        with output.replacing(file) as part:
            _write_picture(part, image) if suffix == ".png" else _write_array(part, image.pixels)
    return Image(pixels, image.color_space, str(file))


def _write_picture(file: Path, image: Image) -> None:
    import PIL.Image

    pixels = image.pixels if image.pixels.shape[2] > 1 else image.pixels[..., 0]
    PIL.Image.fromarray(pixels).save(file, format="PNG")


def _write_array(file: Path, values: NDArray[Any]) -> None:
    with file.open("wb") as stream:
        np.save(stream, values)


def _beside(path: Path, name: str, digest: str, suffix: str) -> Path:
    word = re.sub(r"[^\w-]+", "-", name).strip("-") or "mesh"
    return path.absolute().with_name(f"{path.stem}-{word[:40]}-{digest[:8]}{suffix}")
