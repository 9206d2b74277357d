# SPDX-License-Identifier: MIT
"""Random scenes, rendered here and by Mitsuba, or here in several ways, and whether the pictures agree.

They put together what neither bundled scenes nor tests do: materials of all models, textured, coated, with alpha and
blended, on meshes with all attributes or none and on other shapes; dielectrics and media within each other; lights of
all kinds, environments, fog.

    python scripts/random_scenes.py [--ways] [--seeds FIRST END] [--spp N] [--numbers SEED]

Writes a row for each: its seed and the outcome; where something differs, how many parts of the three scales do, and
their largest standard normal deviates. One scene in a hundred differs by chance, and one with rare bright samples more
often: only what differs with other random numbers too (``--numbers``) is an error. Where Mitsuba cannot show a scene
the row says why.

With ``--ways`` Mitsuba is not asked: pictures with guiding, with light tracing, and with both, sampled adaptively or
made from differences of neighbours, are held against those with none of these.
"""

import argparse
import warnings
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fragtracer.apps.compare import compare_scene
from fragtracer.apps.compare.run import BATCHES, rounded_up
from fragtracer.apps.compare.verdict import Verdict, judge
from fragtracer.errors import FragtracerError
from fragtracer.renderer import Renderer
from fragtracer.scene import (
    PLAIN,
    Camera,
    Density,
    DirectionalLight,
    Disk,
    Environment,
    Fog,
    Geometry,
    Gradient,
    Image,
    Light,
    Material,
    Medium,
    Mesh,
    Panorama,
    Part,
    Placement,
    Plane,
    Rectangle,
    RenderSettings,
    Scene,
    Sky,
    Sphere,
    SpotLight,
    Texture,
    Triangle,
)
from fragtracer.scene.material import DEFAULT_MODEL, MODELS, PANES, SOLIDS

SIZE = (48, 36)
NESTED = 0.08  # metres, the radius of what lies within another solid
_VARIED = (DEFAULT_MODEL, "eon")  # whose textures, normals and alpha Mitsuba shows exactly
_SURFACES = [DEFAULT_MODEL] * 3 + [model for model in MODELS if model not in (DEFAULT_MODEL, *SOLIDS)]
_TEXTURED = ("albedo", "roughness", "metallic", "emission", "normal")
_COAT = ("coat", "coat_roughness", "coat_normal")
_SHEEN = ("sheen_color", "sheen_roughness")
_FILM = ("iridescence", "iridescence_thickness")
_TRANSLUCENT = ("diffuse_transmission", "diffuse_transmission_color")
_NORMALS = ("normal", "coat_normal")
WAYS = {
    "guiding": ("guiding",),
    "light tracing": ("light_tracing",),
    "adaptive with both": ("guiding", "light_tracing", "adaptive"),
    "differences with both": ("guiding", "light_tracing", "gradient_domain"),
}


class RandomScene:
    """Draws the parts of a scene; ``scene()`` is the whole."""

    def __init__(self, seed: int) -> None:
        self.rng = np.random.default_rng(seed)
        self.materials: dict[str, Material] = {}
        self.media: dict[str, Medium] = {}
        # A value of each key of a material; dispersion Mitsuba has not.
        self.values = {
            "albedo": lambda: self.color(0.05, 0.7),  # rough plastic that is brighter Mitsuba shows up to 1 % too dark
            "roughness": lambda: self.number(0.1, 1.0),
            "metallic": lambda: self.pick(0.0, 1.0, self.number()),
            "ior": lambda: self.number(1.05, 2.0),
            "f0": lambda: self.color(0.0, 0.5),
            "metal": lambda: self.pick("gold", "copper", "aluminium"),
            "specular": self.number,
            "diffuse_factor": lambda: "half-vector",
            "anisotropy": lambda: self.number(0.1, 0.9),
            "anisotropy_rotation_degrees": lambda: self.pick(-90.0, 90.0, 180.0),
            "transmittance": lambda: self.color(0.3, 1.0),
            "attenuation_color": lambda: self.color(0.2, 1.0),
            "attenuation_distance": lambda: self.number(0.2, 2.0),
            "interior": self.medium,
            "eta": lambda: self.color(0.1, 3.0),
            "k": lambda: self.color(1.0, 5.0),
            "nonlinear": lambda: False,
        }

    def number(self, least: float = 0.0, most: float = 1.0) -> float:
        return float(self.rng.uniform(least, most))

    def chance(self, probability: float) -> bool:
        return bool(self.rng.random() < probability)

    def pick(self, *choices: Any) -> Any:
        return choices[self.rng.integers(len(choices))]

    def color(self, least: float = 0.05, most: float = 0.95) -> tuple[float, ...]:
        return tuple(self.rng.uniform(least, most, 3).tolist())

    def point(self, low: tuple[float, ...], high: tuple[float, ...]) -> tuple[float, ...]:
        return tuple(self.rng.uniform(low, high).tolist())

    def texture(self, name: str, is_scalar: bool) -> Texture:
        """A small image, mapped anyhow; of roughness not too dark, of normals not too steep."""
        is_normal, is_roughness = name in _NORMALS, name.endswith("roughness")
        shape = (*self.rng.integers(1, 9, 2), 3 if is_normal else self.rng.integers(1, 5))
        least, most = (0.3, 0.7) if is_normal else (0.3 if is_roughness else 0.0, 1.0)
        pixels = self.rng.uniform(least, most, shape)
        if is_normal:
            pixels[..., 2] = 0.95
        space = self.pick("srgb", "linear") if name in ("albedo", "emission") else "linear"
        image = Image(np.uint8(255 * pixels) if self.chance(0.5) else pixels, space)
        channels = {1: "r", 2: "ra", 3: "rgb", 4: "rgba"}[int(shape[2])]
        wraps = ("repeat", "mirror", "clamp")
        made = Texture(
            image,
            self.pick(*wraps),
            self.pick(*wraps),
            self.pick("linear", "nearest"),
            coordinates=int(self.chance(0.25)),
            channel=self.pick(*channels) if is_scalar else "r",
        )
        if self.chance(0.5):
            return made
        moved = {"offset": self.point((-2, -2), (2, 2)), "rotation": self.number(-3, 3)}
        return replace(made, scale=self.point((0.3, -4), (4, 4)), **moved)

    def medium(self, most: float = 2.5) -> str:
        """The name of a new medium, its greatest extinction at ``most`` 1/m."""
        made = Medium(extinction=self.color(0.1 * most, most), albedo=self.color(0.3, 1.0), g=self.number(-0.7, 0.8))
        if self.chance(0.4):
            shape = self.rng.integers(1, 6, 3)
            density = Density(self.rng.uniform(0.0, 2.0, shape) * (self.rng.random(shape) < 0.7))
            low, high = self.point((-1.8, 0.0, -1.8), (-0.6, 0.4, -0.6)), self.point((0.6,) * 3, (1.8,) * 3)
            made = replace(made, density=density, bounds=(low, high))
        name = f"medium {len(self.media)}"
        self.media[name] = made
        return name

    def unbrushed(self, models: list[str], may_emit: bool = True) -> str:
        """As :meth:`material`, its facets alike along all tangents: Mitsuba has its own, those of meshes one for each
        triangle, and of flat shapes."""
        name = self.material(models, may_emit)
        self.materials[name] = replace(self.materials[name], anisotropy=0.0, anisotropy_rotation_degrees=0.0)
        return name

    def material(self, models: list[str], may_emit: bool = True) -> str:
        """The name of a new material of one of ``models``."""
        while True:
            try:
                made = self._material(self.pick(*models))
            except ValueError:  # keys that exclude each other
                continue
            if made.is_emissive and not may_emit:
                continue
            name = f"material {len(self.materials)}"
            self.materials[name] = made
            return name

    def _material(self, model: str) -> Material:
        keys = [key for key in MODELS[model] if key in self.values and self.chance(0.4)]
        made: dict[str, Any] = {key: self.values[key]() for key in keys}
        made |= {"priority": len(self.materials)} if model in SOLIDS else {}
        made |= {"ior": self.number(1.05, 2.0)} if model == "dielectric" else {}  # not that of what is around it
        made |= {"emission": self.color(0.1, 2.0)} if self.chance(0.12) else {}
        made |= {"unlit": True} if self.chance(0.06) else {}
        is_coated = model == DEFAULT_MODEL and self.chance(0.25)
        if is_coated:
            made |= {"coat": self.number(0.2, 1.0), "coat_roughness": self.number(0.1, 0.9)}
            made |= {"coat_ior": self.pick(1.5, self.number(1.2, 2.0))}
        has_sheen = model == DEFAULT_MODEL and self.chance(0.2)
        if has_sheen:
            made |= {"sheen_color": self.color(0.1, 1.0), "sheen_roughness": self.number(0.1, 1.0)}
        has_film = model == DEFAULT_MODEL and self.chance(0.2)
        if has_film:
            made |= {"iridescence": self.number(0.3, 1.0), "iridescence_ior": self.number(1.2, 2.2)}
            made |= {"iridescence_thickness": self.number(50.0, 900.0)}
        transmits = model == DEFAULT_MODEL and not (is_coated or has_sheen or has_film) and self.chance(0.3)
        if transmits:
            made |= {"diffuse_transmission": self.number(0.2, 1.0), "diffuse_transmission_color": self.color(0.1, 1.0)}
        made["black_back"] = model not in (*SOLIDS, *PANES) and not transmits and self.chance(0.2)
        if model not in _VARIED or "anisotropy" in made:
            return Material(model=model, **made)
        layers = (_COAT if is_coated else ()) + (_SHEEN if has_sheen else ()) + (_FILM if has_film else ())
        layers += _TRANSLUCENT if transmits else ()
        scalars = ("roughness", "metallic", "coat", "coat_roughness", "sheen_roughness", "diffuse_transmission", *_FILM)
        for name in _TEXTURED + layers:
            has_meaning = name in MODELS[model] or name in _NORMALS or name in made
            if has_meaning and self.chance(0.4):
                made[f"{name}_texture"] = self.texture(name, name in scalars)
        if made.keys() >= {"normal_texture", "coat_normal_texture"}:
            coordinates = made["normal_texture"].coordinates
            made["coat_normal_texture"] = replace(made["coat_normal_texture"], coordinates=coordinates)
        if self.chance(0.3):
            made |= {"alpha_mode": self.pick("mask", "blend"), "alpha_cutoff": self.number(0.2, 0.7)}
            made |= {"opacity": self.pick(1.0, self.number(0.4, 1.0))}
        double_sided = made["black_back"] or self.chance(0.88)
        made |= {"normal_scale": self.pick(1.0, 0.5, -1.0), "double_sided": double_sided}
        return Material(model=model, **made)

    def blend(self) -> None:
        """Blends two of the materials that Mitsuba can blend exactly."""
        names = [
            name
            for name, m in self.materials.items()
            if m.alpha_mode == "opaque" and m.double_sided and not (m.is_dielectric or m.unlit or m.is_emissive)
        ]
        if len(names) > 1 and self.chance(0.3):
            one, other = map(str, self.rng.choice(names, 2, replace=False))
            weight = {"blend_weight": self.number(0.2, 0.8)}
            if self.chance(0.5):
                weight["blend_weight_texture"] = replace(self.texture("blend_weight", True), coordinates=0)
            self.materials[one] = replace(self.materials[one], blend=other, **weight)

    def mesh(self, models: list[str], places: list[Placement] | None = None) -> Mesh:
        """A ball, a box or a sheet, without ``places`` anywhere; of attributes some that Mitsuba can show there."""
        name = self.unbrushed(models)
        material = self.materials[name]
        is_varied = material.model in _VARIED
        solids = [ball(*self.rng.integers((5, 4), (16, 9))), box()]
        points, triangles, normals, uvs = self.pick(*solids, *([] if material.is_solid else [sheet()] * 2))
        given: dict[str, Any] = {}
        if self.chance(0.9):
            given |= {"uvs": uvs * self.pick(1.0, 2.3), "uvs_1": 1.7 * uvs[:, ::-1] + 0.3}
        if is_varied and self.chance(0.3):
            given["colors"] = self.rng.uniform(0.2, 1.0, (len(points), self.pick(3, 4)))
        if is_varied and normals is not None:
            given |= {"normals": normals} if self.chance(0.7) else {}
        if is_varied and self.chance(0.25):
            tangents = self.rng.normal(size=(len(points), 3))
            along = tangents / np.linalg.norm(tangents, axis=1, keepdims=True)
            given["tangents"] = np.column_stack([along, np.full(len(points), self.pick(-1.0, 1.0))])
        placed = places or [self.placement() for _ in range(self.pick(1, 1, 2))]
        return Mesh([Part(Geometry(points, triangles, **given), name)], placed)

    def placement(self) -> Placement:
        scale = self.pick((0.5,) * 3, self.point((0.25,) * 3, (0.7,) * 3), (0.5, 0.5, -0.4))
        place = self.point((-1.6, 0.3, -1.5), (1.6, 1.3, 1.0))
        return Placement(place, self.point((-180,) * 3, (180,) * 3), scale)

    def solids(self) -> tuple[list[Mesh], list[Sphere]]:
        """Dielectrics and boundaries of media side by side, some with another one within."""
        meshes, spheres = [], []
        for x in self.rng.choice((-1.2, 0.0, 1.2), self.rng.integers(0, 4), replace=False):
            center = (float(x), self.number(0.55, 1.0), self.number(-0.5, 0.8))
            for radius in (self.number(0.3, 0.5), NESTED)[: self.pick(1, 1, 2)]:
                if self.chance(0.5):
                    spheres.append(Sphere(center, radius, self.material([*SOLIDS])))
                else:  # the corners of a box are the farthest
                    turned = self.point((-180,) * 3, (180,) * 3)
                    meshes.append(self.mesh([*SOLIDS], [Placement(center, turned, (radius / 3**0.5,) * 3)]))
        return meshes, spheres

    def flat_shapes(self) -> dict[str, list[Any]]:
        """Of each kind perhaps one; of panes, which are both interfaces, too."""
        made: dict[str, list[Any]] = {"rectangles": [], "disks": [], "triangles": []}
        for shapes in made.values():
            if not self.chance(0.3):
                continue
            place, material = self.point((-1.8, 0.3, -1.8), (1.8, 1.5, 0.5)), self.unbrushed(_SURFACES)
            u, v = self.rng.normal(size=(2, 3)) * 0.4
            if shapes is made["disks"]:
                shapes.append(Disk(place, self.rng.normal(size=3), self.number(0.2, 0.6), material))
            elif shapes is made["triangles"]:
                shapes.append(Triangle((place, place + u, place + v), material))
            else:  # whose edges are at right angles
                shapes.append(Rectangle(place, u, np.cross(u, v) / np.linalg.norm(u), material))
        return made

    def environment(self) -> Environment:
        pixels = self.rng.uniform(size=(*self.rng.integers((2, 2), (20, 40)), 3)) ** 3
        pixels[0, 0] *= self.number(1.0, 30.0)
        turned = {"rotation_degrees": self.number(-180, 180), "tint": self.color(0.5, 1.0)}
        sky = Sky(
            turbidity=self.number(1, 10),
            sun_elevation_degrees=self.number(-5, 80),
            sun_azimuth_degrees=self.number(0, 360),
            sun_radius_degrees=self.number(0.5, 8.0),
            sun=self.chance(0.8),
        )
        return self.pick(
            Environment(image=Panorama(pixels), **turned),
            Environment(gradient=Gradient(self.color(), self.color(), self.color(0.0, 0.3)), **turned),
            Environment(sky=sky, strength=0.05, **turned),
            Environment(radiance=self.color()),
        )

    def lights(self, count: int) -> dict[str, list[Any]]:
        made: dict[str, list[Any]] = {"lights": [], "spot_lights": [], "directional_lights": []}
        for _ in range(count):
            place, power = self.point((-3, 2, -2), (3, 4, 3)), self.color(20.0, 90.0)
            kind = self.pick("ball", "point", "spot", "afar")
            if kind in ("ball", "point"):
                made["lights"].append(Light(place, self.number(0.1, 0.6) if kind == "ball" else 0.0, power=power))
            elif kind == "spot":
                cone = {"inner_degrees": self.number(0, 20), "outer_degrees": self.number(25, 60)}
                made["spot_lights"].append(SpotLight(place, np.negative(place), self.color(5.0, 20.0), **cone))
            else:
                direction = self.point((-1, -1, -1), (1, -0.9, 1))
                made["directional_lights"].append(DirectionalLight(direction, self.color(0.5, 2.0)))
        return made

    def scene(self) -> Scene:
        floor = Placement(scale=(5.0, 1.0, 5.0))
        points, triangles, _, uvs = sheet()
        tiles = Geometry(points, triangles, uvs=6 * uvs, uvs_1=3 * uvs)
        is_plane = self.chance(0.25)
        name = self.unbrushed(_SURFACES, may_emit=not is_plane)
        planes = [Plane((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), name)] if is_plane else []
        meshes, spheres = self.solids()
        if is_plane and self.chance(0.5):
            radius = float(10 ** self.number(1, 6))
            planes, spheres = [], [*spheres, Sphere((0.0, -radius, 0.0), radius, name)]
        meshes += [] if is_plane else [Mesh([Part(tiles, name)], [floor])]
        meshes += [self.mesh(_SURFACES) for _ in range(self.rng.integers(1, 4))]
        for _ in range(self.rng.integers(0, 3)):
            center = self.point((-2, 0.2, -2), (2, 1.2, 0))
            spheres.append(Sphere(center, self.number(0.15, 0.5), self.material(_SURFACES)))
        self.blend()
        environment = self.environment() if self.chance(0.75) else None
        fog = Fog(self.medium(0.3)) if environment is None and self.chance(0.3) else None
        return Scene(
            Camera(
                self.point((-2.5, 0.8, 2.8), (2.5, 2.4, 4.5)),
                (0.0, 0.6, 0.0),
                fov_degrees=self.number(30, 60),
                aperture_radius=self.pick(0.0, self.number(0.0, 0.1)),
            ),
            self.materials,
            media=self.media,
            fog=fog,
            meshes=meshes,
            spheres=spheres,
            planes=planes,
            environment=environment,
            render=RenderSettings(
                bounces=int(self.rng.integers(2, 8)),
                russian_roulette=self.chance(0.5),
                pixel_filter=self.pick("box", "tent"),  # Mitsuba cuts the Gaussian off
                light_samples=self.pick(1, 1, 3),
                sampler=self.pick("texture", "hash"),
                **self.pick({}, {"multiple_scattering": True}, {"geometry": "smith-height-correlated"}),
            ),
            name="random",
            **self.flat_shapes(),
            **self.lights(int(self.rng.integers(environment is None, 3))),
        )


Shape = tuple[NDArray[Any], NDArray[Any], NDArray[Any] | None, NDArray[Any]]  # points, triangles, normals, coordinates


def ball(columns: int, rows: int) -> Shape:
    """Of radius 1, with a seam."""
    u, v = np.meshgrid(np.linspace(0, 1, columns + 1), np.linspace(0, 1, rows + 1))
    theta, phi = np.pi * v, 2 * np.pi * u
    points = np.stack([np.sin(theta) * np.cos(phi), np.cos(theta), -np.sin(theta) * np.sin(phi)], -1).reshape(-1, 3)
    points = np.round(points, 9) + 0.0  # so that the seam is closed
    first = (np.arange(rows)[:, None] * (columns + 1) + np.arange(columns)).ravel()
    corners = first[:, None] + [0, columns + 1, columns + 2, 1]
    triangles = np.concatenate([corners[:, [0, 1, 2]], corners[:, [0, 2, 3]]])
    sides = points[triangles]
    proper = np.linalg.norm(np.cross(sides[:, 1] - sides[:, 0], sides[:, 2] - sides[:, 0]), axis=1) > 1e-7
    return points, triangles[proper], points, np.stack([u, v], -1).reshape(-1, 2)


def box() -> Shape:
    """From -1 to 1, four vertices a side."""
    points, uvs = [], []
    for axis, side in np.ndindex(3, 2):
        sign = 2 * side - 1
        u, v, normal = np.eye(3)[(axis + 1) % 3], sign * np.eye(3)[(axis + 2) % 3], sign * np.eye(3)[axis]
        for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1)):
            points.append(normal + a * u + b * v)
            uvs.append(((a + 1) / 2, (1 - b) / 2))
    first = 4 * np.arange(6)[:, None]
    triangles = np.concatenate([np.add(first, [0, 1, 2]), np.add(first, [0, 2, 3])])
    return np.array(points), triangles, None, np.array(uvs)


def sheet() -> Shape:
    """From -1 to 1 in x and z, facing up."""
    points = np.array([(-1.0, 0.0, 1.0), (1.0, 0.0, 1.0), (1.0, 0.0, -1.0), (-1.0, 0.0, -1.0)])
    return points, np.array([(0, 1, 2), (0, 2, 3)]), None, (points[:, ::2] + 1) / 2


def row(seed: int, spp: int, numbers: int) -> str:
    return f"{seed}: " + outcome_of(lambda: compare_scene(RandomScene(seed).scene(), SIZE, spp, seed=numbers).verdict)


def rows_of_ways(seed: int, spp: int, numbers: int) -> Iterator[str]:
    scene = RandomScene(seed).scene()
    plain = pictures(scene, PLAIN, spp, numbers)

    def verdict_of(names: tuple[str, ...]) -> Verdict:
        return judge(pictures(scene, PLAIN | dict.fromkeys(names, "on"), spp, numbers + 1), plain)

    for way, names in WAYS.items():
        yield f"{seed}, {way}: " + outcome_of(partial(verdict_of, names))


def pictures(scene: Scene, settings: dict[str, Any], spp: int, numbers: int) -> NDArray[np.float32]:
    """(batches, height, width, 3), of ``spp`` samples of each pixel together."""
    each = rounded_up(spp, BATCHES) // BATCHES
    with Renderer(replace(scene, render=replace(scene.render, **settings)), SIZE) as renderer:
        batches = []
        for seed in np.random.SeedSequence(numbers).generate_state(BATCHES):
            renderer.reset(seed=int(seed))
            renderer.sample(each)
            batches.append(renderer.image())
        if count := renderer.non_finite_samples():
            raise ValueError(f"{count} samples were not finite")
    return np.stack(batches)


def outcome_of(judged: Callable[[], Verdict]) -> str:
    try:
        verdict = judged()
    except FragtracerError as error:
        return f"not compared: {error}"
    except Exception as error:  # which nobody should see; the other scenes are still to come
        return f"failed: {error!r}"
    if not verdict.differing:
        return verdict.outcome
    counts = ", ".join(str(int(scale.differs.sum())) for scale in verdict.scales)
    largest = ", ".join(f"{np.abs(scale.z).max():.1f}" for scale in verdict.scales)
    return f"{verdict.outcome} ({counts} parts, deviates to {largest})"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, nargs=2, default=(0, 100), metavar=("FIRST", "END"))
    parser.add_argument("--spp", type=int, default=1024, help="samples per pixel of each renderer")
    parser.add_argument("--numbers", type=int, default=0, metavar="SEED", help="of the random numbers of the pictures")
    parser.add_argument("--ways", action="store_true", help="hold our own ways to sample against each other")
    arguments = parser.parse_args()
    warnings.simplefilter("ignore")
    for seed in range(*arguments.seeds):
        numbers = seed, arguments.spp, arguments.numbers
        for line in rows_of_ways(*numbers) if arguments.ways else [row(*numbers)]:
            print(line, flush=True)


if __name__ == "__main__":
    main()
