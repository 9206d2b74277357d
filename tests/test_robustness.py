# SPDX-License-Identifier: MIT
"""No place, size or shape of a scene shows in the picture: no speckles, no leaks, no grain of float32."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from rendering import Image, Planter, list_at_most, rendered
from scene_builders import Vector, box, lambert, moved, rectangle, scaled, triangles_of

from fragtracer.gpu.context import is_software
from fragtracer.io.toml import load
from fragtracer.packing.shapes import GROWTH, flat_corners, shape_records
from fragtracer.scene import (
    Ambient,
    Camera,
    DirectionalLight,
    Geometry,
    Light,
    Material,
    Mesh,
    Part,
    Plane,
    Rectangle,
    Scene,
    Sphere,
    Triangle,
)

SIZE = (48, 40)


@pytest.fixture(params=["listed", "bvh"])
def storage(request, monkeypatch):
    """Finite shapes on the short list, or in the BVH."""
    list_at_most(monkeypatch, {"listed": 64, "bvh": 0}[request.param])


def shares_beyond(image: Image, other: Image, relative: float) -> float:
    """Share of the pixels that differ by more than ``relative``."""
    difference = np.abs(image.astype(np.float64) - other).max(-1)
    return float((difference > relative * np.maximum(image.max(-1), 1e-9)).mean())


def _evenly(scene: Scene) -> Scene:
    """``scene`` with as many samples in each pixel."""
    return replace(scene, render=replace(scene.render, adaptive="off"))


@pytest.mark.parametrize("name", ["three-spheres-ambient", "cornell-box", "mirror", "roughness-grid", "light-size-0"])
def test_scale_does_not_show(ctx, name):
    """A scene in millimetres and one in kilometres give the same picture: bit for bit where the factor is
    a power of two; else numbers are rounded elsewhere, and a path or two in a million goes another way.
    Adaptive sampling would then place other samples."""
    scene = _evenly(load(name))
    image = rendered(ctx, scene, 32, SIZE, shared=True)
    for factor in (2.0**-10, 2.0**10):
        np.testing.assert_array_equal(rendered(ctx, scaled(scene, factor), 32, SIZE, shared=True), image)
    for factor in (1e-3, 1e3):
        other = rendered(ctx, scaled(scene, factor), 32, SIZE, shared=True)
        assert abs(other.mean(dtype=np.float64) / image.mean(dtype=np.float64) - 1) < 1e-4
        assert shares_beyond(image, other, 1e-4) < 0.02
        assert shares_beyond(image, other, 0.01) < 0.005


@pytest.mark.parametrize("name", ["three-spheres-ambient", "cornell-box"])
def test_place_does_not_show(ctx, name):
    """Ten kilometres from the origin float32 is a millimetre coarse; the picture stays as it is."""
    scene = _evenly(load(name))
    image = rendered(ctx, scene, 32, SIZE, shared=True)
    for offset in ((1e4, 0.0, 0.0), (-1e4, 1e4, 1e4)):
        other = rendered(ctx, moved(scene, offset), 32, SIZE, shared=True)
        assert shares_beyond(image, other, 1e-4) < 0.02
        assert shares_beyond(image, other, 0.01) < 0.005


@pytest.mark.parametrize("kind", ["light", "sphere"])
def test_distance_of_a_sun_does_not_show(ctx, kind):
    """A light, or a sphere that shines, as large in the sky and as bright from ten kilometres as from a thousand."""
    scene = load("three-spheres")
    toward = np.array((-1.5, 3.5, 2.0)) / np.linalg.norm((-1.5, 3.5, 2.0))
    floor = rectangle((0.0, 0.0, 0.0), (0.0, 0.0, 4.0), (4.0, 0.0, 0.0), "floor")
    images = []
    for distance in (1e4, 1e6):
        place, radius = tuple(toward * distance), 0.02 * distance
        lit = replace(scene, planes=(), rectangles=[floor], lights=[Light(place, radius, radiance=1000.0)])
        if kind == "sphere":
            shining = Material(albedo=0.0, specular=0.0, emission=1000.0)
            spheres = [*scene.spheres, Sphere(place, radius, "sun")]
            lit = replace(lit, lights=[], spheres=spheres, materials={**scene.materials, "sun": shining})
        images.append(rendered(ctx, lit, 64, SIZE, shared=True))
    assert images[0].mean() == pytest.approx(images[1].mean(), rel=0.002)
    assert shares_beyond(*images, 0.05) < 0.02


def rotation() -> NDArray[np.float64]:
    """Some rotation, along no axis."""
    matrix, _ = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))
    return matrix * np.sign(np.linalg.det(matrix))


def rotated_box(rotation: NDArray[np.float64], offset: Vector) -> list[Rectangle]:
    return [
        Rectangle(rotation @ r.corner + offset, rotation @ r.edge_u, rotation @ r.edge_v, r.material)
        for r in box("wall")
    ]


MIDDLE, ASIDE = (0.0, 0.0, 0.0), (30.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("estimator", "rotation", "offset", "triangles"),
    [
        ("nee", np.eye(3), MIDDLE, True),
        ("nee", np.eye(3), ASIDE, False),
        ("mis", rotation(), MIDDLE, False),
        ("mis", rotation(), ASIDE, True),
    ],
    ids=[
        "nee-middle-triangles",
        "nee-aside-rectangles",
        "mis-rotated-middle-rectangles",
        "mis-rotated-aside-triangles",
    ],
)
def test_closed_box_stays_black_inside(ctx, estimator, rotation, offset, triangles):
    """Ten million walks from wall to wall, none of which finds a crack to the bright light outside; also
    where a second object makes the scene, and so its rounding, thirty times as large as the box.

    Rotated rectangles aside are those of test_cracks_between_shapes_are_found."""
    assert_black_inside(ctx, 64, estimator, rotation, offset, triangles)


def assert_black_inside(ctx, spp, estimator, rotation, offset, triangles):
    walls = rotated_box(rotation, offset)
    halves = [half for wall in walls for half in triangles_of(wall)]
    far = [Sphere((-30.0, 0.0, 0.0), 1.0, "wall")] if any(offset) else []
    scene = Scene(
        Camera(rotation @ (0.3, 0.2, 0.9) + offset, rotation @ (-0.9, -0.7, -0.8) + offset, fov_degrees=100.0),
        {"wall": lambert(1.0)},
        spheres=far,
        ambient=Ambient(1e6),
        lights=[
            Light(np.add(offset, (0.0, 0.0, 2.0)), power=1e6),
            Light(np.add(offset, (2.0, 2.0, 2.0)), 0.3, power=1e6),
        ],
        **({"triangles": halves} if triangles else {"rectangles": walls}),
    )
    settings = {"bounces": 40, "estimator": estimator, "russian_roulette": False}
    assert not rendered(ctx, scene, spp, (64, 64), **settings).any()


@pytest.mark.parametrize("triangles", [False, True], ids=["rectangles", "triangles"])
def test_closed_box_in_the_bvh_stays_black_inside(ctx, monkeypatch, triangles):
    list_at_most(monkeypatch, 0)
    assert_black_inside(ctx, 16, "mis", rotation(), ASIDE, triangles)


@pytest.mark.usefixtures("storage")
@pytest.mark.parametrize(
    ("storage", "factor"), [("listed", 1.0), ("listed", 1e3), ("bvh", 1e-3), ("bvh", 1e3)], indirect=["storage"]
)
def test_light_under_a_floor_stays_there(ctx, factor):
    """Neither the floor nor the foot of what stands on it lets light through."""
    block = [
        rectangle((1.0, 0.5, 0.5), (0.6, 0.0, 0.0), (0.0, 1.0, 0.0), "white"),
        rectangle((0.7, 0.5, 0.2), (0.0, 0.0, 0.6), (0.0, 1.0, 0.0), "white"),
        rectangle((1.0, 1.0, 0.2), (0.0, 0.0, 0.6), (0.6, 0.0, 0.0), "white"),
    ]
    scene = Scene(
        Camera((0.5, 0.6, 2.0), (0.3, 0.2, 0.0), fov_degrees=50.0),
        {"white": lambert(1.0)},
        spheres=[Sphere((0.0, 0.5, 0.0), 0.5, "white")],
        planes=[Plane((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), "white")],
        rectangles=block,
        lights=[Light((0.0, -0.5, 0.0), power=1e6), Light((1.0, -1.0, 0.5), 0.3, power=1e6)],
    )
    image = rendered(ctx, scaled(scene, factor), 256, (64, 64), bounces=20, russian_roulette=False)
    assert not image.any()


def lit_from_the_eye(height: float) -> Scene:
    """Everything that is seen is lit, for the light is where the camera is: a ball on the floor, a wall. But a ray that
    starts off a surface beside the edge of another one may meet that: so no edge is before them."""
    eye = (0.3, height, 4.0)
    return Scene(
        Camera(eye, (0.0, 0.3, 0.0), fov_degrees=40.0),
        {"matte": lambert(0.5)},
        spheres=[Sphere((0.0, 0.5, 0.0), 0.5, "matte")],
        planes=[Plane((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), "matte")],
        rectangles=[rectangle((0.0, 0.0, -2.0), (40.0, 0.0, 0.0), (0.0, 40.0, 0.0), "matte")],
        lights=[Light(eye, power=100.0)],
    )


def panel_lit_from_the_eye(height: float) -> Scene:
    """Two triangles, of which the picture is full."""
    scene = lit_from_the_eye(height)
    return replace(
        scene,
        camera=replace(scene.camera, target=(1.2, 0.5, 0.0), fov_degrees=4.0),
        spheres=[],
        planes=[],
        rectangles=[],
        triangles=triangles_of(rectangle((1.2, 0.5, 0.0), (0.6, 0.0, 0.6), (0.0, 1.0, 0.0), "matte")),
    )


@pytest.mark.usefixtures("storage")
@pytest.mark.parametrize(("factor", "height"), [(1e-3, 1.0), (1e-3, 0.01), (1.0, 0.1), (1e3, 1.0), (1e3, 0.01)])
def test_no_surface_shades_itself(ctx, factor, height):
    """Not one sample of 150,000 is dark, the floor's at grazing angles neither."""
    for scene in (lit_from_the_eye(height), panel_lit_from_the_eye(height)):
        assert rendered(ctx, scaled(scene, factor), 1, (480, 320), bounces=1, shared=True).min() > 0


def test_a_wide_rectangle_does_not_shade_itself(ctx, storage):
    """10 km wide, turned anyhow, and seen over its middle: each point sees nothing but the ambient light."""
    turn = rotation()
    corner, u, v = (tuple(1e4 * turn @ x) for x in ((-0.5, 0.0, 0.5), (1.0, 0.0, 0.0), (0.0, 0.0, -1.0)))
    eye, target, up = (tuple(turn @ x) for x in ((0.0, 100.0, 0.0), (300.0, 0.0, 0.0), (0.0, 1.0, 0.0)))
    scene = Scene(
        Camera(eye, target, up),
        {"white": lambert(1.0)},
        rectangles=[Rectangle(corner, u, v, "white")],
        ambient=Ambient((1.0,) * 3),
    )
    assert (rendered(ctx, scene, 16, (96, 64), bounces=1) == 1).all()


def test_a_ground_of_a_kilometre_does_not_shade_itself(ctx, storage):
    """A lamp lights it as it does a plane."""
    whole = Scene(
        Camera((0.0, 2.0, 4.0), (0.0, 0.0, 0.0), fov_degrees=30.0),
        {"matte": lambert(0.5)},
        planes=[Plane((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), "matte")],
        lights=[Light((0.0, 4.0, 0.0), 1.0, power=100.0)],
    )
    ground = rectangle((0.0, 0.0, 0.0), (0.0, 0.0, 1000.0), (1000.0, 0.0, 0.0), "matte")
    image, other = (
        rendered(ctx, scene, 16, (24, 20), bounces=1)
        for scene in (whole, replace(whole, planes=[], rectangles=[ground]))
    )
    np.testing.assert_allclose(other, image, rtol=0.003)


def balls_on(ground: str) -> Scene:
    """Two balls of less than a metre."""
    wide = np.array([(-5e3, 0.0, 5e3), (5e3, 0.0, 5e3), (5e3, 0.0, -5e3), (-5e3, 0.0, -5e3)])
    quad = Mesh([Part(Geometry(wide, np.array([(0, 1, 2), (0, 2, 3)])), "matte")])
    balls = [Sphere((0.0, 0.5, 0.0), 0.5, "matte"), Sphere((0.8, 0.3, 0.3), 0.3, "matte")]
    stray = Sphere((0.0, 0.0, 1e5), 1.0, "matte")
    plane = Plane((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), "matte")
    return Scene(
        Camera((0.0, 1.2, 4.0), (0.0, 0.4, 0.0)),
        {"matte": lambert(0.7)},
        spheres=[*balls, *([stray] if ground == "a stray ball" else [])],
        planes=[] if ground == "a wide mesh" else [plane],
        meshes=[quad] if ground == "a wide mesh" else [],
        lights=[Light((2.0, 3.0, 2.0), power=100.0)],
        ambient=Ambient((0.2,) * 3),
    )


@pytest.mark.parametrize("ground", ["a wide mesh", "a stray ball"])
def test_contact_shadows_do_not_depend_on_what_is_far_away(ctx, ground):
    """A ground 10 km wide in place of a plane, and a ball that is 100 km away."""
    image, other = (rendered(ctx, balls_on(name), 64, (64, 48))[20:] for name in ("a plane", ground))
    assert abs(other.mean(dtype=np.float64) / image.mean(dtype=np.float64) - 1) < 2.5e-3


def test_floor_to_the_horizon_has_its_brightness(ctx):
    """Seen from 1 cm above, to a kilometre's distance: what each pixel shows is its own irradiance."""
    power, height = 1e6, 3.0
    scene = Scene(
        Camera((0.0, 0.01, 0.0), (0.0, 0.01, -1.0), fov_degrees=1.0),
        {"matte": lambert(0.5)},
        planes=[Plane((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), "matte")],
        lights=[Light((0.0, height, 0.0), power=power)],
    )
    width, rows = 40, 200
    image = rendered(ctx, scene, 16, (width, rows), bounces=1)[..., 0]
    assert not image[: rows // 2].any()  # the sky
    below = (np.arange(rows // 2)[:, None] + (np.arange(64) + 0.5) / 64) / (rows / 2) * np.tan(np.radians(0.5))
    distance2 = (0.01 / below) ** 2 + height**2
    expected = (0.5 / np.pi * power / (4 * np.pi) * height / distance2**1.5).mean(1)
    # Off the middle column the floor is farther by a ten-thousandth; the row at the horizon has noise.
    np.testing.assert_allclose(image[rows // 2 + 1 :].mean(1), expected[1:], rtol=0.01)
    assert image[rows // 2 + 1 :].min() > 0.5 * expected[1:].min()


# Errors that these tests must find: file, text, what stands there instead, and the check.
PLANTED = {
    "rays start on the surface": (
        *("shape/ray.glsl", "RAY_OFFSET = 1e-6", "RAY_OFFSET = 0.0"),
        lambda ctx: test_no_surface_shades_itself(ctx, 1.0, 1.0),
    ),
    "rays start high above a wide mesh": (
        *("shape/ray.glsl", "RAY_OFFSET = 1e-6", "RAY_OFFSET = 4e-6"),
        lambda ctx: test_contact_shadows_do_not_depend_on_what_is_far_away(ctx, "a wide mesh"),
    ),
    "rays start on a rectangle whose corners are far away": (
        *("shape/flat.glsl", ": dot(abs(shape.normal), abs(shape.a))", ": 0.0"),
        lambda ctx: test_a_wide_rectangle_does_not_shade_itself(ctx, None),
    ),
    "rays start a constant above the surface": (
        *("shape/ray.glsl", "(RAY_OFFSET * extent)", "1e-5"),
        lambda ctx: test_no_surface_shades_itself(ctx, 1e3, 1.0),
    ),
    "rays start along the normal alone": (
        *("integrator/vertex.glsl", "normal - direction", "normal"),
        lambda ctx: assert_black_inside(ctx, 64, "mis", rotation(), (100.0, 50.0, 0.0), True),
    ),
}


@pytest.mark.parametrize(("file", "text", "replacement", "check"), PLANTED.values(), ids=PLANTED)
def test_planted_error_is_found(ctx, monkeypatch, tmp_path, file, text, replacement, check):
    Planter(monkeypatch, tmp_path)(file, text, replacement)
    with pytest.raises(AssertionError):
        check(ctx)


@pytest.mark.parametrize(("offset", "triangles"), [(ASIDE, False), ((100.0, 50.0, 0.0), True)])
def test_cracks_between_shapes_are_found(ctx, monkeypatch, offset, triangles):
    """The planted error: shapes end where they should, to the last bit, and so neighbours do not meet; or, where a
    GPU rounds so that they do, end earlier by as much as they should later."""
    assert_black_inside(ctx, 64, "mis", rotation(), offset, triangles)
    monkeypatch.setattr("fragtracer.packing.shapes.GROWTH", 0.0 if is_software(ctx) else -GROWTH)
    with pytest.raises(AssertionError):
        assert_black_inside(ctx, 64, "mis", rotation(), offset, triangles)


def test_a_camera_far_away_sees_the_same(ctx) -> None:
    """Of a cube of 2 cm on a table, in parallel sunlight, by a field of view as narrow as it is far."""
    cube = box("a", 0.01)
    table = Rectangle((-0.5, -0.01, 0.5), (1.0, 0.0, 0.0), (0.0, 0.0, -1.0), "a")
    sun = DirectionalLight((-1.0, -0.5, 0.2), 3.0)
    images = []
    for distance in (1.0, 3000.0):
        position = tuple(distance * np.array([0.2, 0.69, 0.69]))
        view = Camera(position, (0.0, 0.0, 0.0), fov_degrees=float(np.degrees(0.08 / distance)))
        scene = Scene(view, {"a": lambert(0.5)}, rectangles=[*cube, table], directional_lights=[sun])
        images.append(rendered(ctx, scene, 16, (32, 32), bounces=1))
    near, far = images
    assert (np.abs(far - near) > 0.05 * near.max()).mean() < 0.02


@pytest.mark.parametrize("radius", [1e6, 1e12])
def test_a_globe_is_a_ground(ctx, storage, monkeypatch, radius) -> None:
    """However large: balls on it have the shadows that they have on a plane; taken for another sphere it has not."""
    balls = [Sphere((0.5 * x, 0.1, 0.4 * x * x), 0.1, "a") for x in (-1, 0, 1)]
    view = Camera((0.0, 2.0, 2.0), (0.0, 0.0, 0.0), fov_degrees=35.0)
    plain = Scene(view, {"a": lambert(0.5)}, spheres=balls, lights=[Light((1.0, 3.0, 1.0), power=100.0, radius=0.2)])
    flat = rendered(ctx, replace(plain, planes=[Plane((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), "a")]), 16, SIZE)
    globe = replace(plain, spheres=[*balls, Sphere((0.0, -radius, 0.0), radius, "a")])
    assert shares_beyond(rendered(ctx, globe, 16, SIZE), flat, 0.01) < 0.01
    monkeypatch.setattr("fragtracer.packing.shapes._GLOBE", 1e30)
    assert shares_beyond(rendered(ctx, globe, 16, SIZE), flat, 0.01) > 0.1


def test_globes_are_far_larger_than_what_is_near_and_pass_close_by() -> None:
    """Those of lights are none: pages change their radii."""
    spheres = [Sphere((0.0, -y, 0.0), r, "a") for y, r in ((40, 40), (30, 30), (42, 40), (-41, 40), (40, 40))]
    lights = np.array([-1, -1, -1, -1, 0])
    records = shape_records(spheres, {"a": lambert(0.5)}, {"a": 0}, lights, np.zeros(3), 100.0, 1.0)
    assert records.is_globe.tolist() == [True, False, False, True, False]
    values = records.words[[0, 3]].view(np.float32)
    np.testing.assert_allclose(values[:, 1, 3], 1 / 40)
    np.testing.assert_allclose(values[:, 2, :3], [[0, 0, 0], [0, 1, 0]], atol=1e-6)


def test_shapes_grow_by_their_own_coordinates_and_lights_do_not() -> None:
    """However large the scene is around them."""
    rectangle = Rectangle((3.0, 0.0, 0.0), (0.01, 0.0, 0.0), (0.0, 0.01, 0.0), "a")
    shapes = [rectangle, replace(rectangle, corner=(300.0, 0.0, 0.0)), rectangle]
    records = shape_records(shapes, {"a": lambert(0.5)}, {"a": 0}, np.array([-1, -1, 0]), np.zeros(3), 1e4, 1.0)
    corners = np.ascontiguousarray(records.words[:, :2, :3]).view(np.float32).astype(np.float64)
    grown = np.linalg.norm(corners[:, 1] - corners[:, 0], axis=1) - 0.01
    assert (np.abs(grown - [2 * 3.01e-6, 2 * 300.01e-6, 0]) < [5e-7, 5e-5, 5e-7]).all()


def test_tips_of_thin_triangles_do_not_grow_far() -> None:
    """Others grow beyond all three sides."""
    thin = Triangle(((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1e-3, 0.0)), "a")
    other = Triangle(((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.2, 0.0)), "a")
    grown, exact = (flat_corners([thin, other], np.zeros(3), growth)[1] for growth in (1e-3, 0.0))
    moved = np.linalg.norm(grown - exact, axis=2)
    assert moved[0].max() == pytest.approx(16e-3)
    sides = ((0, 0, 0), (0, -1, 0)), ((0, 0, 0), (-1, 0, 0)), ((1, 0, 0), np.array((0.2, 1, 0)) / 1.04**0.5)
    for point, normal in sides:
        assert ((grown[1] - point) @ normal).max() == pytest.approx(1e-3)
