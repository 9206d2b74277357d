# SPDX-License-Identifier: MIT
"""Mitsuba scenes for tests, and the files that they name."""

import shutil
import warnings
from pathlib import Path

import numpy as np
import PIL.Image
import pytest

from fragtracer.io.images import write_image
from fragtracer.io.toml import load
from fragtracer.scene import Material, Scene

SENSOR = """<sensor type="perspective"><float name="fov" value="45"/>
<transform name="to_world"><lookat origin="0.5, 3, 7" target="0, 0.2, 0" up="0, 1, 0"/></transform>
<film type="hdrfilm"><integer name="width" value="48"/><integer name="height" value="36"/><rfilter type="box"/></film>
<sampler type="independent"><integer name="sample_count" value="32"/></sampler></sensor>"""
PATHS = '<integrator type="volpath"><integer name="max_depth" value="6"/></integrator>'
FILES = Path(__file__).parent / "mitsuba"
GGX = '<string name="distribution" value="ggx"/>'


def placed(*steps: str) -> str:
    return f'<transform name="to_world">{"".join(steps)}</transform>'


def bitmap(name: str, file: str, *more: str, raw: bool = False) -> str:
    text = f'<string name="filename" value="{file}"/><boolean name="raw" value="{str(raw).lower()}"/>'
    return f'<texture type="bitmap" name="{name}">{text}{"".join(more)}</texture>'


def gray(value: str) -> str:
    return f'<bsdf type="diffuse"><rgb name="reflectance" value="{value}"/></bsdf>'


def both(bsdf: str) -> str:
    return f'<bsdf type="twosided">{bsdf}</bsdf>'


def written(folder: Path, body: str, head: str = PATHS + SENSOR) -> Path:
    path = folder / "scene.xml"
    path.write_text(f'<scene version="3.0.0">\n{head}\n{body}\n</scene>')
    return path


def read(folder: Path, body: str, head: str = PATHS + SENSOR) -> Scene:
    """The scene, whose reader must not say that something is not as in Mitsuba."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return load(written(folder, body, head))


def notes(folder: Path, body: str, head: str = PATHS + SENSOR) -> str:
    """What the reader says is not as in Mitsuba."""
    with pytest.warns(UserWarning, match="not as in Mitsuba") as found:
        load(written(folder, body, head))
    return str(found[0].message)


def material(folder: Path, bsdf: str) -> Material:
    (found,) = read(folder, f'<shape type="sphere">{bsdf}</shape>').materials.values()
    return found


def images(folder: Path) -> None:
    """Textures and a map, beside the scene."""
    rng = np.random.default_rng(7)
    PIL.Image.fromarray(rng.integers(40, 255, (8, 16, 3), np.uint8)).save(folder / "color.png")
    PIL.Image.fromarray((255 * (rng.random((4, 8)) > 0.4)).astype(np.uint8)).save(folder / "holes.png")
    PIL.Image.fromarray(rng.integers(60, 200, (8, 8), np.uint8)).save(folder / "grey.png")
    rows, columns = np.meshgrid(np.linspace(0, np.pi, 128), np.linspace(0, 2 * np.pi, 256), indexing="ij")
    waves = [1 + 0.8 * np.sin(rows) * np.sin(columns + phase) for phase in (0.0, 2.0, 4.0)]
    write_image(folder / "sky.exr", np.stack(waves, -1))


def torus(path: Path, around: int = 48, across: int = 24) -> None:
    """A ring in the plane of x and z, with normals and texture coordinates."""
    u, v = (2 * np.pi * np.arange(n) / n for n in (around, across))
    u, v = (x.ravel() for x in np.meshgrid(u, v, indexing="ij"))
    normals = np.stack([np.cos(v) * np.cos(u), np.sin(v), np.cos(v) * np.sin(u)], -1)
    centers = np.stack([np.cos(u), np.zeros_like(u), np.sin(u)], -1)
    lines = [f"v {x} {y} {z}" for x, y, z in 0.35 * centers + 0.15 * normals]
    lines += [f"vt {x} {y}" for x, y in zip(u / 7, v / 7, strict=True)] + [f"vn {x} {y} {z}" for x, y, z in normals]
    first = np.arange(around * across).reshape(around, across) + 1
    corners = first, np.roll(first, -1, 1), np.roll(np.roll(first, -1, 0), -1, 1), np.roll(first, -1, 0)
    for a, b, c, d in zip(*(x.ravel().tolist() for x in corners), strict=True):
        lines += [f"f {p}/{p}/{p} {q}/{q}/{q} {r}/{r}/{r}" for p, q, r in ((a, b, c), (a, c, d))]
    path.write_text("\n".join(lines))


def scene_file(folder: Path, name: str) -> Path:
    """A scene, with all that it names.

    ``surfaces`` has a sphere of each BSDF, and rectangles with textures, seen from both sides; ``shapes`` has shapes of
    all kinds, mirrored, turned inside out and in instances, a medium, and lights.
    """
    images(folder)
    torus(folder / "ring.obj")
    return Path(shutil.copy(FILES / f"{name}.xml", folder / "scene.xml"))


def quietly(path: Path | str) -> Scene:
    """The scene, whatever is not as in Mitsuba."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return load(path)
