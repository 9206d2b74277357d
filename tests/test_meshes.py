# SPDX-License-Identifier: MIT
"""Images of meshes: the same as of the shapes they are made of, whatever estimates the light; and what
an edit costs."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

import moderngl
import numpy as np
import pytest
from mesh_shapes import ball, field, geometry, grid, mesh_scene, smooth
from rendering import ESTIMATORS, Image, batches, list_at_most, rendered
from scene_builders import lambert, triangles_of
from scipy import stats

from fragtracer.errors import SceneError
from fragtracer.packing import PackedScene, hierarchy, instances, pack
from fragtracer.renderer import Renderer
from fragtracer.scene import (
    Ambient,
    Camera,
    Geometry,
    Light,
    Material,
    Mesh,
    Part,
    Placement,
    Plane,
    Rectangle,
    RenderSettings,
    Scene,
    Sphere,
    Texture,
    Triangle,
)
from fragtracer.scene import Image as Pixels

BATCHES = 8
LEVEL = 1e-3


def tiled(rectangle: Rectangle, side: int) -> Mesh:
    """A rectangle as a mesh of 2 side² triangles."""
    s, t = np.meshgrid(*[np.linspace(0, 1, side + 1)] * 2, indexing="ij")
    corner, u, v = (np.asarray(x) for x in (rectangle.corner, rectangle.edge_u, rectangle.edge_v))
    points = corner + s.reshape(-1, 1) * u + t.reshape(-1, 1) * v
    return Mesh((Part(Geometry(points, grid(side, side)), rectangle.material),))


def lit_corner() -> Scene:
    """A floor, a wall, a ball, and two panels that shine, one of them to a side where nothing is; none touches what it
    lights, where light sampling alone would have no finite variance for a t-test."""
    panel = Rectangle((-0.5, 1.5, -0.5), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0), "panel")
    away = Rectangle((1.0, 0.2, -0.8), (0.0, 0.0, 0.8), (0.0, 0.6, 0.0), "dim")
    floor = Rectangle((-2.0, 0.0, -2.0), (0.0, 0.0, 4.0), (4.0, 0.0, 0.0), "floor")
    wall = Rectangle((-2.0, 0.0, -1.0), (4.0, 0.0, 0.0), (0.0, 2.0, 0.0), "wall")
    return Scene(
        camera=Camera((0.3, 1.0, 3.0), (0.0, 0.6, 0.0)),
        materials={
            "floor": lambert((0.6, 0.5, 0.4)),
            "wall": Material(albedo=(0.3, 0.5, 0.7), roughness=0.3),
            "panel": lambert(0.2, (4.0, 3.0, 2.0)),
            "dim": lambert(0.5, 0.5),
            "ball": Material(metal="gold", roughness=0.5),
        },
        rectangles=(floor, wall, panel, away),
        spheres=(Sphere((0.2, 0.4, 0.3), 0.3, "ball"),),
        lights=(Light((1.5, 1.5, 1.5), power=5.0),),
        ambient=Ambient(0.1),
        render=RenderSettings(bounces=3),
    )


def agree(first: np.ndarray, second: np.ndarray) -> None:
    """Independent images (batches, h, w, 3) have the same means: Welch's test of 4 x 4 pixels each, Šidák."""
    blocks = [x.reshape(len(x), 8, 4, 8, 4, 3).mean(axis=(2, 4)).reshape(len(x), -1) for x in (first, second)]
    p = stats.ttest_ind(*blocks, equal_var=False).pvalue
    p = p[np.isfinite(p)]
    assert len(p) > 100
    assert p.min() > 1 - (1 - LEVEL) ** (1 / len(p))
    assert np.mean(p < 0.05) < 0.15


@cache
def corner_of_rectangles(ctx: moderngl.Context, bounces: int) -> Image:
    return batches(ctx, lit_corner(), 256, range(BATCHES), estimator="mis", bounces=bounces)


@pytest.mark.parametrize(("estimator", "bounces", "spp"), [("nee", 1, 256), ("bsdf", 1, 800), ("mis", 3, 256)])
def test_rectangles_as_meshes_give_the_same_image(
    ctx: moderngl.Context, estimator: str, bounces: int, spp: int
) -> None:
    """After one bounce, where there is less noise, or more; later vertices are like the first."""
    scene = lit_corner()
    as_meshes = replace(scene, rectangles=(), meshes=tuple(tiled(r, 5) for r in scene.rectangles))
    seeds = range(100, 100 + BATCHES)
    agree(corner_of_rectangles(ctx, bounces), batches(ctx, as_meshes, spp, seeds, estimator=estimator, bounces=bounces))


def test_many_triangles_in_a_bvh_give_the_same_image(ctx: moderngl.Context, monkeypatch: pytest.MonkeyPatch) -> None:
    """And the same as a mesh of them, of which all that emit are one light."""
    scene = lit_corner()
    triangles = tuple(t for r in scene.rectangles for t in triangles_of(r))
    scene = replace(scene, rectangles=(), triangles=triangles)
    one = corner_of_rectangles(ctx, scene.render.bounces)
    list_at_most(monkeypatch, 0)
    packed = pack(scene, scene.render, 32, 32)
    assert packed.uniforms["u_flat_count"] == 0
    assert len(packed.scene_records["AreaLight"]) == 4
    agree(one, batches(ctx, scene, 256, range(100, 100 + BATCHES)))
    names = sorted({t.material for t in triangles})
    parts = tuple(
        Part(
            Geometry(np.concatenate([t.vertices for t in triangles if t.material == name]), _corners(name, triangles)),
            name,
        )
        for name in names
    )
    as_mesh = replace(scene, triangles=(), meshes=(Mesh(parts),))
    assert pack(as_mesh, scene.render, 32, 32).uniforms["u_mesh_light_count"] == 4
    agree(one, batches(ctx, as_mesh, 256, range(200, 200 + BATCHES)))


def _corners(name: str, triangles: tuple[Triangle, ...]) -> np.ndarray:
    return np.arange(3 * sum(t.material == name for t in triangles)).reshape(-1, 3)


@pytest.mark.parametrize("estimator", ESTIMATORS)
def test_furnace_in_a_closed_flat_mesh(ctx: moderngl.Context, estimator: str) -> None:
    """Le (1 - albedo^(n + 1)) / (1 - albedo) everywhere within a ball that shines inwards."""
    points, triangles = ball(16, 8)
    camera = Camera((0.0, 0.0, 0.4), (0.0, 0.0, 0.0), fov_degrees=90.0)
    settings = RenderSettings(bounces=4, russian_roulette=False)
    inward = geometry((points, triangles[:, ::-1]))
    scene = mesh_scene(inward, material=lambert(0.5, 1.0), camera=camera, render=settings)
    image = rendered(ctx, scene, 16 if estimator == "bsdf" else 256, estimator=estimator)
    error = image.astype(np.float64) / (2 * (1 - 0.5**5)) - 1
    # By BSDF sampling each sample is the answer. Light sampling alone has no finite variance where triangles meet: nine
    # pixels of ten are held to a bound of their own, the others by the mean.
    share, of_pixel, of_mean = {"bsdf": (1, 1e-5, 1e-5), "mis": (1, 0.02, 0.001), "nee": (0.9, 0.04, 0.005)}[estimator]
    assert np.quantile(np.abs(error), share) < of_pixel
    assert abs(error.mean()) < of_mean


def test_furnace_around_a_smooth_mesh(ctx: moderngl.Context) -> None:
    """Interpolated normals make no light, and lose little: a white ball in even light is hardly seen."""
    scene = mesh_scene(
        smooth(ball(48, 24)),
        material=lambert(1.0),
        ambient=Ambient(1.0),
        camera=Camera((0.0, 0.0, 4.0), (0.0, 0.0, 0.0)),
        render=RenderSettings(bounces=32, russian_roulette=False),
    )
    image = rendered(ctx, scene, 512)
    assert image.max() < 1 + 1e-5
    assert image.mean() > 0.99
    assert image.min() > 0.85  # no black rim


def test_a_smooth_ball_is_lit_like_a_sphere(ctx: moderngl.Context) -> None:
    """No black terminator: a coarse ball with normals differs from the sphere by far less than a flat one."""
    light = Light((3.0, 2.0, 2.0), power=100.0)
    camera = Camera((0.0, 0.0, 6.0), (0.0, 0.0, 0.0), fov_degrees=18.0)
    settings = RenderSettings(bounces=1)

    def image(**shapes: object) -> np.ndarray:
        materials = {"mesh": lambert(0.8)}
        scene = Scene(camera=camera, materials=materials, lights=(light,), render=settings, **shapes)
        return rendered(ctx, scene, 64)

    true = image(spheres=(Sphere((0.0, 0.0, 0.0), 1.0, "mesh"),))
    rounded, flat = (image(meshes=mesh_scene(g).meshes) for g in (smooth(ball(32, 16)), geometry(ball(32, 16))))
    error = [np.abs(x - true)[true > 0].mean() / true.mean() for x in (rounded, flat)]
    assert error[0] < 0.05
    assert error[0] < 0.6 * error[1]


def test_a_smooth_mesh_leaves_flat_surfaces_as_they_are(ctx: moderngl.Context) -> None:
    """Up to the horizon, with one out of view: how much a floor reflects there says how it is seen."""
    floor = Material(model="conductor", metal="gold", roughness=0.0)
    scene = mesh_scene(
        smooth(ball(8, 4)),
        materials={"mesh": Material(), "floor": floor},
        planes=(Plane((0.0, -2.0, 0.0), (0.0, 1.0, 0.0), "floor"),),
        ambient=Ambient(1.0),
        camera=Camera((0.0, 0.0, -5.0), (0.0, 0.0, -6.0), fov_degrees=1.0),
        render=RenderSettings(bounces=1),
    )
    without = rendered(ctx, replace(scene, meshes=()), 4, (4, 64))
    np.testing.assert_allclose(rendered(ctx, scene, 4, (4, 64)), without, rtol=1e-5)
    assert without[-1, :, 2].max() < 0.98


def test_no_light_leaks_through_a_smooth_wall(ctx: moderngl.Context) -> None:
    """A light behind a thin wavy wall whose normals lean far over is not seen in front of it."""
    points, triangles = field(24)
    lean = np.random.default_rng(1).normal((0.0, 0.7, 0.0), 1.0, points.shape)
    wall = Geometry(20 * points, triangles, normals=lean)
    scene = mesh_scene(
        wall, material=Material(albedo=0.8, roughness=0.4), lights=(Light((0.0, -30.0, 0.0), power=1e5),)
    )
    scene = replace(scene, camera=Camera((0.0, 8.0, 6.0), (0.0, 0.0, 0.0)), render=RenderSettings(bounces=6))
    assert rendered(ctx, scene, 64).max() == 0


PLACEMENTS = (Placement((-0.8, 0.3, 0.0), (20, 30, 40)), Placement((0.7, 0.4, 0.2), (0, 50, 0), (-0.5, 0.3, 0.6)))
COPIED = geometry(ball(8, 4))


@cache
def copies_by_hand(ctx: moderngl.Context) -> Image:
    """Of points moved to the :data:`PLACEMENTS`."""
    moved = [COPIED.positions @ p.matrix[:3, :3].T + p.matrix[:3, 3] for p in PLACEMENTS]
    meshes = tuple(Mesh((Part(Geometry(points, COPIED.triangles), "ball"),)) for points in moved)
    return batches(ctx, replace(lit_corner(), spheres=(), meshes=meshes), 128, range(BATCHES))


@pytest.mark.parametrize("most_copied", [10**6, 0], ids=["one space", "instances"])
def test_copies_are_where_their_matrices_put_them(
    ctx: moderngl.Context, monkeypatch: pytest.MonkeyPatch, most_copied: int
) -> None:
    """Against the points moved by hand, with a mirror, and lit."""
    scene = replace(lit_corner(), spheres=())
    copied = replace(scene, meshes=(Mesh((Part(COPIED, "ball"),), PLACEMENTS),))
    expected = copies_by_hand(ctx)
    monkeypatch.setattr(instances, "MOST_REPEATED", most_copied)
    hierarchy.pack_bvh.cache_clear()
    assert pack(copied, scene.render, 32, 32).features["HAS_INSTANCES"] == (most_copied == 0)
    agree(expected, batches(ctx, copied, 128, range(100, 100 + BATCHES)))
    hierarchy.pack_bvh.cache_clear()


def test_copies_have_the_normals_of_a_mesh_that_is_there_once(
    ctx: moderngl.Context, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Unit vectors at the vertices of the copy, between which they are interpolated; so too the tangents, which a
    normal map shows."""
    points, triangles = ball(8, 4)
    uvs = np.column_stack([np.arctan2(points[:, 0], points[:, 2]) / (2 * np.pi), points[:, 1]])
    body = Geometry(points, triangles, points, uvs)
    bumps = Texture(Pixels(np.array([[[0.8, 0.3, 0.7]]]), "linear"))
    flat = Placement((0.7, 0.4, 0.2), (0, 50, 0), (-0.5, 0.1, 0.9))
    scene = replace(
        lit_corner(),
        spheres=(),
        materials=lit_corner().materials | {"ball": Material(normal_texture=bumps)},
        meshes=(Mesh((Part(body, "ball"),), (PLACEMENTS[0], flat)),),
    )
    found = []
    for most_copied in (10**6, 0):
        monkeypatch.setattr(instances, "MOST_REPEATED", most_copied)
        hierarchy.pack_bvh.cache_clear()
        with Renderer(scene, (96, 64), context=ctx, spp=1) as renderer:
            renderer.render()
            found.append(renderer.aov("normal"))
    hierarchy.pack_bvh.cache_clear()
    assert np.ptp(found[0]) > 1
    np.testing.assert_allclose(found[0], found[1], atol=2e-4)  # the flat copy is seen at grazing angles


@pytest.mark.parametrize("radius", [4e-3, 2e-4])
def test_copies_share_a_looser_tree_where_they_are_tiny_and_many(
    ctx: moderngl.Context, monkeypatch: pytest.MonkeyPatch, radius: float
) -> None:
    """On a floor of 20 m, seen from near: the pictures differ by what rounding does at edges."""
    rng = np.random.default_rng(7)
    places = [Placement((x, radius, z), scale=radius) for x, z in 8 * radius * rng.uniform(-1.0, 1.0, (40, 2))]
    floor = Rectangle((-10.0, 0.0, 10.0), (20.0, 0.0, 0.0), (0.0, 0.0, -20.0), "floor")
    points, triangles = ball(16, 8)
    scene = replace(
        lit_corner(),
        camera=Camera((0.0, 12 * radius, 30 * radius), (0.0, 0.0, 0.0)),
        spheres=(),
        planes=(),
        rectangles=(floor,),
        meshes=(Mesh((Part(Geometry(points, triangles, points), "ball"),), places),),
    )
    found = []
    for most_copied in (10**6, 0):
        monkeypatch.setattr(instances, "MOST_REPEATED_LOOSE", most_copied)
        hierarchy.pack_bvh.cache_clear()
        assert pack(scene, scene.render, 32, 32).features["HAS_INSTANCES"] == (most_copied == 0)
        found.append(rendered(ctx, scene, 64, (96, 64)))
    hierarchy.pack_bvh.cache_clear()
    differs = np.abs(found[0] - found[1]).max(axis=2) > 0.02 * found[0].mean()
    assert differs.mean() < 0.01
    assert found[1].mean(dtype=np.float64) == pytest.approx(found[0].mean(dtype=np.float64), rel=1e-3)


def fails(*_: object, **__: object) -> None:
    raise AssertionError("a tree was built")


def edits() -> dict[str, Callable[[Scene], Scene]]:
    def colored(scene: Scene) -> Scene:
        return replace(scene, materials=scene.materials | {"mesh": Material(albedo=(0.1, 0.2, 0.3))})

    def moved(scene: Scene) -> Scene:
        mesh = scene.meshes[0]
        return replace(scene, meshes=(replace(mesh, instances=(Placement((1.0, 2.0, 3.0), (10.0, 0.0, 0.0)),)),))

    return {"colour": colored, "place": moved}


@pytest.mark.parametrize("name", edits())
def test_an_edit_builds_no_tree(monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    scene = mesh_scene(smooth(ball()))
    before = pack(scene, scene.render, 64, 64)
    monkeypatch.setattr(instances, "build", fails)
    after = pack(edits()[name](scene), scene.render, 64, 64)
    # The same arrays are not uploaded again (gpu/textures.py).
    for table, part in (("u_shapes", 1), ("u_vertices", 0), ("u_mesh_lights", 0)):
        assert (after.tables[table][part] is before.tables[table][part]) == (name == "colour"), table
    assert after.features == before.features
    assert after.flags == before.flags


def test_a_tree_is_found_on_disk(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = mesh_scene(geometry(field(30, seed=5)))
    first = pack(scene, scene.render, 64, 64)
    hierarchy.pack_bvh.cache_clear()
    instances._topologies.clear()
    monkeypatch.setattr(instances, "build", fails)
    again = pack(scene, scene.render, 64, 64)
    assert records(again) is not records(first)
    np.testing.assert_array_equal(records(again), records(first))


def test_trees_of_many_small_meshes_share_a_file(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Beside that of a large one, and are those that each has alone; two meshes of the same triangles share one."""
    monkeypatch.setenv("FRAGTRACER_CACHE", str(tmp_path))
    monkeypatch.setattr(instances, "_FILES", 4)
    shapes = [*(geometry(field(2, seed=seed)) for seed in (0, 1, 2, 3, 4, 5, 0)), geometry(field(30, seed=6))]
    alone = [instances._built([shape])[0].children for shape in shapes]
    for path in tmp_path.iterdir():
        path.unlink()
    parts = tuple(Part(shape, "mesh") for shape in shapes)
    scene = replace(mesh_scene(shapes[0]), meshes=(Mesh(parts),))
    first = pack(scene, scene.render, 64, 64)
    assert len(list(tmp_path.glob("bvh-*"))) == 2
    for shape, children in zip(shapes, alone, strict=True):
        np.testing.assert_array_equal(instances._topologies[shape].children, children)
    hierarchy.pack_bvh.cache_clear()
    instances._topologies.clear()
    monkeypatch.setattr(instances, "build", fails)
    np.testing.assert_array_equal(records(pack(scene, scene.render, 64, 64)), records(first))


def records(packed: PackedScene) -> np.ndarray:
    """Those of the BVH, (n, 4, 4)."""
    return packed.tables["u_shapes"][1].reshape(-1, 4, 4)


def test_a_hundred_copies_of_a_large_mesh_take_the_memory_of_one() -> None:
    shape = geometry(field(60))
    places = tuple(Placement((3.0 * i, 0.0, 0.0)) for i in range(100))
    one, many = (
        pack(replace(mesh_scene(shape), meshes=(Mesh((Part(shape, "mesh"),), p),)), RenderSettings(), 64, 64)
        for p in (places[:1], places)
    )
    assert many.features["HAS_INSTANCES"]
    assert len(records(many)) < len(records(one)) + 200


@pytest.mark.parametrize("scale", [(1e-5, 1e-5, 1e-5), (1.0, 1e-8, 1.0)], ids=["tiny", "flat"])
def test_a_tiny_or_flat_copy_has_triangles_of_its_own(ctx: moderngl.Context, scale: tuple[float, float, float]) -> None:
    """Through its matrix the rounding of rays would be larger than the mesh, and so would all boxes of the tree."""
    shape = geometry(field(60))
    places = tuple(Placement((3.0 * i, 0.0, 0.0)) for i in range(40))
    odd = Placement((0.0, 1.0, 0.0), (20.0, 0.0, 10.0), scale)
    scene = replace(mesh_scene(shape), ambient=Ambient(1.0), camera=Camera((0.0, 3.0, 3.0), (0.0, 0.0, 0.0)))
    alike, other = (replace(scene, meshes=(Mesh((Part(shape, "mesh"),), p),)) for p in (places, (*places, odd)))
    one, both = (pack(s, s.render, 64, 64) for s in (alike, other))
    assert one.features["HAS_INSTANCES"]
    assert both.features["HAS_INSTANCES"]
    assert len(shape.triangles) < len(records(both)) - len(records(one)) < 2 * len(shape.triangles)
    image = batches(ctx, other, 16, range(1))[0]
    assert np.isfinite(image).all()
    assert image.mean() > 0.1


@pytest.mark.slow
def test_a_million_triangles(ctx: moderngl.Context) -> None:
    scene = mesh_scene(
        geometry(field(708)),
        ambient=Ambient(1.0),
        camera=Camera((1.5, 1.5, 1.5), (0.0, 0.0, 0.0)),
        material=lambert(0.5),
    )
    assert len(scene.meshes[0].parts[0].geometry.triangles) > 1_000_000
    with Renderer(scene, (64, 48), context=ctx, bounces=1) as renderer:
        renderer.sample(2)
        image = renderer.image()
        assert renderer.non_finite_samples() == 0
        assert renderer.gpu_bytes > 1_000_000 * 64
    middle = image[20:28, 24:40]
    assert 0.3 < middle.mean() < 0.51  # half of what comes, less what other hills hide


def test_a_mesh_beyond_what_can_be_traced_is_an_error() -> None:
    scene = mesh_scene(geometry((1e16 * ball()[0], ball()[1])))
    with pytest.raises(SceneError, match="smaller scale"):
        pack(scene, scene.render, 64, 64)
