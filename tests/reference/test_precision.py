# SPDX-License-Identifier: MIT
"""The reference's single precision against float64 and closed forms, and beside it Mitsuba's own integrator and
emitter, whose errors are the reason for reference/plugins/path.py and sphere_light.py."""

from dataclasses import replace

import numpy as np
import pytest

from fragtracer.io import read_model
from fragtracer.io.toml import load
from fragtracer.reference.lights import black_sphere
from fragtracer.reference.translate import scene_tree, to_mitsuba
from fragtracer.scene import Camera, DirectionalLight, Disk, Material, Plane, Rectangle, Scene, Sphere, Triangle

COUNT = 2**20


def floor_points(mi, points):
    """Points of a horizontal surface, as Mitsuba's integrators have them."""
    import drjit as dr

    si = dr.zeros(mi.SurfaceInteraction3f, len(points))
    si.p, si.n, si.t = mi.Point3f(points.T.astype(np.float32)), mi.Normal3f(0, 1, 0), mi.Float(1)
    si.sh_frame = mi.Frame3f(si.n)
    return si


def irradiance_error(mi, distance, plugins):
    """Relative, below the lamp of red-bounce at a distance in metres, where it is π L (r / d)²."""
    radius = load("red-bounce").lights[0].radius
    lamp = black_sphere((0.0, distance, 0.0), radius, (1.0, 1.0, 1.0), plugins)
    world = mi.load_dict({"type": "scene", "lamp": lamp})
    si = floor_points(mi, np.zeros((COUNT, 3)))
    u = np.random.default_rng(1).random((2, COUNT), dtype="f4")
    sample, weight = world.sample_emitter_direction(si, mi.Point2f(u), False)
    sample.emitter = mi.EmitterPtr(world.emitters()[0])
    density = world.pdf_emitter_direction(si, sample)
    np.testing.assert_allclose(density, sample.pdf, rtol=1e-5)
    return (weight.x * sample.d.y).numpy().mean(dtype=float) / (np.pi * (radius / distance) ** 2) - 1


def test_the_cone_of_a_far_light_is_exact(mi):
    for distance in (0.2, 3, *range(300, 400, 20), 1e5):
        assert abs(irradiance_error(mi, distance, plugins=True)) < 2e-5
    assert max(abs(irradiance_error(mi, d, plugins=False)) for d in range(300, 400, 20)) > 0.2


def radiance(mi, world, integrator, origins, directions):
    """Red of what comes back along rays, (n,), by an integrator that makes one bounce."""
    ray = mi.Ray3f(*(mi.Vector3f(v.T.astype(np.float32)) for v in (origins, directions)))
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(0, len(origins))
    own = {"type": integrator, "max_depth": 2, "rr_depth": 9}
    arguments = (world, sampler, ray) if integrator == "path" else (None, world, sampler, ray)
    return np.array(mi.load_dict(own).sample(*arguments)[0].x)


def lit(points, center, radius, light):
    """Whether nothing of a sphere is between points and the light, in float64."""
    ahead = light - points
    distance = np.linalg.norm(ahead, axis=1, keepdims=True)
    along = np.clip(((center - points) * ahead / distance).sum(axis=1, keepdims=True), 0, distance)
    return np.linalg.norm(points + along * ahead / distance - center, axis=1) > radius


def test_the_edge_of_a_shadow_is_where_it_should_be(mi):
    """Of the square metre around a shadow in light-size-0 Mitsuba's ``path`` has a ten-thousandth lit that should not
    be, or the other way about: its rays start some tenths of a millimetre off the surface."""
    scene = load("light-size-0")
    sphere, light = scene.spheres[1], np.array(scene.lights[0].position)
    toward = np.subtract(sphere.center, light)
    middle = light + toward * (light[1] / -toward[1])
    points = middle + np.random.default_rng(2).uniform(-0.5, 0.5, (COUNT, 3)) * (1, 0, 1)
    points = points.astype(np.float32).astype(float)
    exact = lit(points, sphere.center, sphere.radius, light)
    world = mi.load_dict(
        to_mitsuba(Scene(spheres=[sphere], planes=scene.planes, lights=scene.lights, materials=scene.materials))
    )
    wrong, above, down = {}, points + np.array([0, 0.1, 0]), np.broadcast_to((0.0, -1.0, 0.0), points.shape)
    for integrator in ("path", "fragtracer_path"):
        found = radiance(mi, world, integrator, above, down)
        wrong[integrator] = ((found > 0) != exact).mean()
    assert wrong["path"] > 5e-5
    assert wrong["fragtracer_path"] < 5e-6


MATT = {"m": Material(albedo=0.5, specular=0.0)}
AWAY = np.array((30.0, -20.0, 50.0))
SHAPES = {
    "a sphere": {"spheres": [Sphere((0.0, 0.0, 0.0), 1.0, "m")]},
    "a sphere far from the origin": {"spheres": [Sphere(tuple(AWAY), 0.3, "m")]},
    "a plane": {"planes": [Plane((0.0, -1.0, 0.0), (0.3, 1.0, 0.2), "m")]},
    "a disk": {"disks": [Disk(tuple(AWAY), (0.3, 1.0, 0.2), 2.0, "m")]},
    "a rectangle": {"rectangles": [Rectangle((-9.0, -1.0, -9.0), (18.0, 0.0, 3.0), (-3.0, 0.0, 18.0), "m")]},
    "a triangle": {"triangles": [Triangle(((-20.0, 3.0, 9.0), (25.0, -1.0, -9.0), (0.0, 4.0, -30.0)), "m")]},
}


@pytest.mark.parametrize("name", SHAPES)
def test_no_point_of_a_convex_shape_is_in_its_own_shadow(mi, name):
    """Seen from ten metres and from a thousand, to within a milliradian of grazing light and grazing view."""
    rng = np.random.default_rng(3)
    directions = rng.normal(size=(COUNT // 16, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    target = AWAY if "far" in name or "disk" in name else np.zeros(3)
    target = target + rng.uniform(-1, 1, directions.shape)
    for distance in (10, 1000):
        origins = target - distance * directions
        for sun in ((0.3, -1.0, 0.2), (1.0, -0.3, -0.5), (1.0, -0.01, 0.2)):
            light = DirectionalLight(sun, np.pi)
            scene = Scene(Camera((0.0, 0.0, 1000.0), (0.0, 0.0, 0.0)), MATT, directional_lights=[light], **SHAPES[name])
            world = mi.load_dict(to_mitsuba(scene))
            found = radiance(mi, world, "fragtracer_path", origins, directions)
            ray = mi.Ray3f(*(mi.Vector3f(v.T.astype(np.float32)) for v in (origins, directions)))
            si = world.ray_intersect(ray)
            normal, view = np.array(si.n).T, np.array(si.wi.z)
            cosine = -np.sign(view) * (normal @ sun) / np.linalg.norm(sun)
            bright = np.array(si.is_valid()) & (cosine > 1e-3) & (np.abs(view) > 1e-3)
            assert bright.sum() > 1000
            np.testing.assert_allclose(found[bright], 0.5 * cosine[bright], rtol=1e-3)


@pytest.mark.parametrize(("radius", "shaded"), [(60.0, 0.001), (500.0, 0.01), (1e5, 0.01), (6.4e6, 0.01)])
def test_a_ground_is_where_it_should_be(mi, monkeypatch, tmp_path, radius, shaded):
    """However large the sphere: met within a millimetre, as precise as the eye is far, and not in its own shadow, which
    Mitsuba's sphere is."""
    eye = np.array([0.5, 2.0, -0.3])
    light = DirectionalLight((0.3, -1.0, 0.2), np.pi)
    sphere = Sphere((0.1, -radius, 0.2), radius, "m")
    scene = Scene(Camera(tuple(eye), (0.0, 0.0, 0.0)), MATT, spheres=[sphere], directional_lights=[light])
    rng = np.random.default_rng(4)
    aims = np.column_stack([rng.uniform(-5, 5, COUNT // 16), np.zeros(COUNT // 16), rng.uniform(-5, 5, COUNT // 16)])
    directions = aims - eye
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    directions = directions.astype(np.float32).astype(float)
    origins = np.broadcast_to(eye, directions.shape)

    def intersected(world):
        return world.ray_intersect(mi.Ray3f(*(mi.Vector3f(v.T.astype(np.float32)) for v in (origins, directions))))

    def dark(world):
        """The share of places that are in shadow."""
        cosine = -np.array(intersected(world).n).T @ light.direction / np.linalg.norm(light.direction)
        return (radiance(mi, world, "fragtracer_path", origins, directions) < 0.96 * 0.5 * cosine).mean()

    world = mi.load_dict(to_mitsuba(scene, tmp_path))
    si = intersected(world)
    met = origins + np.array(si.t, float)[:, None] * directions - (sphere.center + np.array([0, radius, 0]))
    height = met[:, 1] + np.square(met).sum(axis=1) / (2 * radius)
    assert np.abs(height).max() < 1e-3
    assert dark(world) == 0
    np.testing.assert_allclose(np.array(si.n).T, (met + np.array([0, radius, 0])) / radius, atol=0.4 / radius + 2e-4)
    monkeypatch.setattr("fragtracer.reference.shapes.is_ground", lambda *_: False)
    assert dark(mi.load_dict(to_mitsuba(scene))) > shaded


def test_a_ground_is_closed(tmp_path):
    """And lies on the sphere, its front outside. A sphere seen from further away stays one, as does a small one, and
    one far from the origin, where Mitsuba's rays begin further away."""
    sphere = Sphere((1.0, 2.0, -199.0), 200.0, "m")
    scene = Scene(Camera((1.0, 2.0, 28.0), (0.0, 0.0, 0.0)), MATT, spheres=[sphere])
    near = replace(scene, camera=Camera((1.0, 2.0, 2.0), (0.0, 0.0, 0.0)))
    small = replace(near, spheres=[Sphere((1.0, 2.0, 1.0), 0.999, "m")])
    away = replace(near, camera=Camera((301.0, 2.0, 2.0), (0.0, 0.0, 0.0)), spheres=[Sphere((301, 2, -199), 200, "m")])
    for made in (scene, small, away):
        assert scene_tree(made, tmp_path)["sphere_0"]["type"] == "sphere"
    scene = near
    assert scene_tree(scene, tmp_path)["sphere_0"]["type"] == "ply"
    [part] = read_model(tmp_path / "sphere_0.ply").mesh.parts
    points, triangles = part.geometry.positions, part.geometry.triangles
    np.testing.assert_allclose(np.linalg.norm(points - sphere.center, axis=1), 200.0, atol=1e-4)
    edges = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()
    a, b, c = (points[triangles[:, i]] - sphere.center for i in range(3))
    volumes = (a * np.cross(b, c)).sum(axis=1) / 6
    assert (volumes > 0).all()
    assert volumes.sum() == pytest.approx(4 / 3 * np.pi * 200.0**3, rel=2e-3)


def test_a_sphere_does_not_light_itself(mi):
    """From outside; a point on it is rounded to either side."""
    glow = Sphere((3.0, 1.0, -2.0), 0.4, "glow")
    scene = Scene(materials={"glow": Material(emission=1.0)}, spheres=[glow])
    world = mi.load_dict(to_mitsuba(scene))
    normals = np.random.default_rng(0).normal(size=(4096, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    for scale in (1.0, 1.0001):
        si = floor_points(mi, glow.center + scale * glow.radius * normals)
        sample, _ = world.emitters()[0].sample_direction(si, mi.Point2f(0.3, 0.6))
        assert ((sample.pdf.numpy() > 0) == (scale > 1)).all()
