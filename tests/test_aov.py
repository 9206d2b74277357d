# SPDX-License-Identifier: MIT
"""Layers: parts of the light add up to the picture, those of the first surface are what Mitsuba finds there, mattes
what Cryptomatte has, and a file keeps them all."""

import json
from dataclasses import replace
from pathlib import Path

import moderngl
import numpy as np
import pytest
from rendering import Planter, assert_same
from scene_builders import lambert
from shaders.bsdf_oracle import Filmed, facet_fresnel, sheen_albedo
from small_pictures import SIZE, SPP

from fragtracer.aov import AOVS, DENOISING, channels, checked, matte, matte_id, matte_metadata, murmur3
from fragtracer.errors import FragtracerError, OutputError
from fragtracer.gpu.context import is_software
from fragtracer.io.images import read_image, read_layers, write_image
from fragtracer.io.toml import load
from fragtracer.renderer import Renderer
from fragtracer.scene import Ambient, Camera, DirectionalLight, Material, Medium, Plane, Scene, Sphere

LIGHT = [name for name, layer in AOVS.items() if layer.is_light]
CENTRE = ("camera/camera.glsl", "+ pixel_filter_sample(u.xy)", "+ 0.0 * u.xy")


@pytest.mark.parametrize("name", ["three-spheres-ambient", "glass", "sun-sky", "wax"])
def test_parts_of_the_light_add_up(ctx: moderngl.Context, name: str) -> None:
    """To the picture itself, which is the one that it is without them."""
    with Renderer(load(name), SIZE, context=ctx, aovs=["diffuse"], guiding="off") as renderer:
        renderer.sample(SPP)
        image = renderer.image()
        parts = {part: renderer.aov(part).astype(np.float64) for part in LIGHT}
        assert renderer.metadata()["adaptive_decision"] == "off: the parts of the light are sampled evenly"
    with Renderer(load(name), SIZE, context=ctx, adaptive="off", guiding="off") as renderer:
        renderer.sample(SPP)
        assert_same(ctx, renderer.image(), image)
    for split in (("direct", "indirect"), ("diffuse", "specular")):
        total = parts["emission"] + parts[split[0]] + parts[split[1]]
        np.testing.assert_allclose(total, image, rtol=2e-6, atol=1e-9)
    for part in LIGHT:
        assert (parts[part] >= 0).all()
    assert min(parts["direct"].mean(), parts["indirect"].mean()) > 1e-3 * image.mean()


def test_parts_with_guiding_and_more_light_samples(ctx: moderngl.Context) -> None:
    with Renderer(load("three-spheres"), SIZE, context=ctx, aovs=["direct"], guiding="on", light_samples=3) as renderer:
        renderer.sample(SPP)
        total = sum(renderer.aov(part).astype(np.float64) for part in ("emission", "diffuse", "specular"))
        np.testing.assert_allclose(total, renderer.image(), rtol=2e-6, atol=1e-9)


@pytest.mark.parametrize("estimator", ["mis", "nee", "bsdf"])
def test_parts_of_a_furnace(ctx: moderngl.Context, estimator: str) -> None:
    """A matte ball of albedo 0.6 in light 1 from everywhere: the background emits, the ball scatters 0.6, once."""
    scene = Scene(
        Camera((0, 0, 3), (0, 0, 0)), {"m": lambert(0.6)}, spheres=[Sphere((0, 0, 0), 1, "m")], ambient=Ambient(1)
    )
    exact = 0 if is_software(ctx) else 1e-7  # a GPU may round the parts and their sum in different ways
    with Renderer(scene, (9, 9), context=ctx, aovs=["direct"], estimator=estimator) as renderer:
        renderer.sample(64)
        ball = renderer.aov("albedo")[4, 4] > 0
        assert ball.all()
        expected = {"emission": 0.0, "direct": 0.6, "diffuse": 0.6, "specular": 0.0, "indirect": 0.0}
        for part, value in expected.items():
            np.testing.assert_allclose(renderer.aov(part)[4, 4], value, rtol=1e-5, atol=exact, err_msg=part)
        np.testing.assert_allclose(renderer.aov("emission")[0, 0], 1.0)


@pytest.mark.parametrize(
    ("integrator", "layer", "sheen"),
    [("path", "albedo", 0.0), ("path", "albedo", 0.5), ("path", "denoising_albedo", 0.5), ("split-sum", "", 0.0)],
)
def test_a_coat_from_above(ctx: moderngl.Context, integrator: str, layer: str, sheen: float) -> None:
    """It reflects F0 and passes the rest, in and out, in layers and by the split sum; in layers to sheen, too."""
    paint = Material(albedo=0.6, specular=0.0, coat=0.8, coat_ior=2.0, coat_roughness=0.1)
    paint = replace(paint, sheen_color=sheen, sheen_roughness=1.0)
    scene = Scene(Camera((0, 0, 3), (0, 0, 0)), {"m": paint}, spheres=[Sphere((0, 0, 0), 1, "m")], ambient=Ambient(1))
    reflected, of_sheen = 0.8 / 9, sheen * sheen_albedo(1.0, np.array(1.0))
    with Renderer(scene, (33, 33), context=ctx, integrator=integrator, bounces=1) as renderer:
        renderer.sample(64)
        found = (renderer.aov(layer) if layer else renderer.image())[16, 16]
    base = (1 - of_sheen) * 0.6 + of_sheen
    np.testing.assert_allclose(found, (1 - reflected) ** 2 * base + reflected, rtol=0.01)


def test_a_film_from_above(ctx: moderngl.Context) -> None:
    """It adds to the albedo what the base no longer gets."""
    soap = Material(albedo=0.6, specular=0.0, iridescence=0.8, iridescence_ior=2.0, iridescence_thickness=100.0)
    scene = Scene(Camera((0, 0, 3), (0, 0, 0)), {"m": soap}, spheres=[Sphere((0, 0, 0), 1, "m")], ambient=Ambient(1))
    with Renderer(scene, (33, 33), context=ctx, aovs=["albedo"]) as renderer:
        renderer.sample(64)
        found = renderer.aov("albedo")[16, 16]
    names = ("iridescence", "iridescence_ior", "iridescence_thickness")
    film = facet_fresnel(Filmed(**{name: getattr(soap, name) for name in names}), 1.0)
    assert film.max() > 0.2
    np.testing.assert_allclose(found, film + (1 - film) * 0.6, rtol=0.01)


@pytest.mark.parametrize("model", ["default", "rough-plastic", "sheen"])
def test_what_is_diffuse_of_a_coated_base(ctx: moderngl.Context, model: str) -> None:
    """By one directional light, without noise: the part of the coat does not depend on the base. Sheen is diffuse."""

    def parts(albedo: float) -> tuple[np.ndarray, np.ndarray]:
        keys = {"default": {}, "sheen": {"sheen_color": 0.7, "sheen_roughness": 0.6}}.get(model, {"model": model})
        scene = Scene(
            Camera((0, 0, 3), (0, 0, 0)),
            {"m": Material(albedo=albedo, roughness=0.4, **keys)},
            spheres=[Sphere((0, 0, 0), 1, "m")],
            directional_lights=[DirectionalLight((-1, -1, -1), 1.0)],
        )
        with Renderer(scene, (16, 16), context=ctx, aovs=["direct"], bounces=1, estimator="nee") as renderer:
            renderer.sample(4)
            assert not renderer.aov("indirect").any()
            return renderer.aov("diffuse"), renderer.aov("specular")

    (diffuse, specular), (no_diffuse, same) = parts(0.8), parts(0.0)
    assert min(diffuse.max(), specular.max()) > 0.01
    assert no_diffuse.any() == (model == "sheen")
    np.testing.assert_allclose(specular, same, rtol=1e-4, atol=1e-6)


def test_parts_do_not_depend_on_passes_and_begin_anew(ctx: moderngl.Context) -> None:
    found = []
    for rays in (2, 8):
        with Renderer(load("cornell-box"), SIZE, context=ctx, aovs=["direct"], rays=rays) as renderer:
            renderer.sample(3)
            renderer.reset(seed=0)
            renderer.sample(8)
            found.append(renderer.aov("direct"))
            before = renderer.aov("depth")
            renderer.reset(load("furnace"))
            renderer.sample(8)
            assert not np.array_equal(renderer.aov("depth"), before)
    np.testing.assert_array_equal(*found)


@pytest.mark.parametrize("name", ["cornell-box", "knot"])
def test_first_surface_is_that_of_mitsuba(
    ctx: moderngl.Context, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, name: str
) -> None:
    """Seen through the centres of the pixels, without a lens; but for pixels whose edges either of the two rounds."""
    mi = pytest.importorskip("mitsuba")
    from fragtracer.reference.translate import to_mitsuba
    from fragtracer.reference.variant import mitsuba_variant

    scene = load(name)
    scene = replace(scene, camera=replace(scene.camera, aperture_radius=0.0))
    width, height = size = (20, 15)
    Planter(monkeypatch, tmp_path)(*CENTRE)
    names = ("depth", "position", "normal", "albedo")
    with Renderer(scene, size, context=ctx) as renderer:
        renderer.sample(2)
        ours = {layer: renderer.aov(layer) for layer in names}
    folder = tmp_path / "mitsuba"
    folder.mkdir()
    sized = replace(scene, render=replace(scene.render, width=width, height=height))
    theirs = {layer: np.zeros_like(values) for layer, values in ours.items()}
    eye = np.array(scene.camera.position)
    forward = np.subtract(scene.camera.target, eye) / np.linalg.norm(np.subtract(scene.camera.target, eye))
    with mitsuba_variant("scalar_rgb"):
        world = mi.load_dict(to_mitsuba(sized, folder, exact=False), parallel=False)
        for y in range(height):
            for x in range(width):
                place = mi.Point2f((x + 0.5) / width, (y + 0.5) / height)
                ray, _ = world.sensors()[0].sample_ray(0, 0.5, place, mi.Point2f(0.5))
                hit = world.ray_intersect(ray)
                theirs["depth"][y, x] = np.inf
                if hit.is_valid():
                    theirs["position"][y, x] = hit.p
                    theirs["depth"][y, x] = (np.array(hit.p) - eye) @ forward
                    theirs["normal"][y, x] = hit.sh_frame.n
                    theirs["albedo"][y, x] = hit.bsdf().eval_diffuse_reflectance(hit)
        del world
    with np.errstate(invalid="ignore"):
        same = np.isclose(ours["depth"], theirs["depth"], rtol=1e-4)
    assert same.mean() > 0.97
    np.testing.assert_allclose(ours["position"][same], theirs["position"][same], atol=2e-4 * ours["depth"][same].min())
    if name == "cornell-box":  # whose materials are Mitsuba's own; shading normals are our plugin's, with maps
        np.testing.assert_allclose(ours["albedo"][same], theirs["albedo"][same], atol=1e-5)
        turned = np.abs((ours["normal"] * theirs["normal"]).sum(axis=2))
        np.testing.assert_allclose(turned[same & np.isfinite(ours["depth"])], 1, atol=1e-5)


def test_normals_seen_from_the_camera(ctx: moderngl.Context) -> None:
    """That of a ball towards a camera aslant is (0, 0, 1) in its middle; to the right of it x rises, above it y."""
    scene = Scene(
        Camera((3, 2, 1), (0, 0, 0), fov_degrees=20), {"m": lambert(0.5)}, spheres=[Sphere((0, 0, 0), 1, "m")]
    )
    with Renderer(scene, (31, 31), context=ctx) as renderer:
        renderer.sample(64)
        normal = renderer.aov("normal_camera")
    np.testing.assert_allclose(normal[15, 15], (0, 0, 1), atol=0.02)
    assert normal[15, 25, 0] > 0.3
    assert normal[5, 15, 1] > 0.3


def test_motion_of_a_wall(ctx: moderngl.Context) -> None:
    """4 m ahead, when the camera was 0.1 m further left and 0.2 m further down: to the right and up by so many pixels.
    What is infinitely far away moves when the camera turns alone."""
    camera = Camera((0, 0, 4), (0, 0, 0), fov_degrees=40)
    wall = Scene(camera, {"m": lambert(0.5)}, planes=[Plane((0, 0, 0), (0, 0, 1), "m")])
    before = replace(camera, position=(-0.1, -0.2, 4), target=(-0.1, -0.2, 0))
    pixels_per_metre = 24 / (2 * 4 * np.tan(np.radians(20)))
    with Renderer(wall, SIZE, context=ctx) as renderer:
        renderer.sample(4)
        assert not renderer.aov("motion").any()
        moved = renderer.aov("motion", previous_camera=before)
    np.testing.assert_allclose(
        moved, np.broadcast_to(np.multiply((0.1, 0.2), pixels_per_metre), moved.shape), atol=1e-4
    )
    with Renderer(Scene(camera, ambient=Ambient(1)), SIZE, context=ctx) as renderer:
        renderer.sample(4)
        np.testing.assert_allclose(renderer.aov("motion", previous_camera=before), 0, atol=1e-4)
        turned = renderer.aov("motion", previous_camera=replace(camera, target=(0.4, 0, 0)))
    np.testing.assert_allclose(turned[12, 16], (-0.1 * 4 * pixels_per_metre, 0), atol=0.05)


@pytest.mark.parametrize("name", ["glass", "mirror", "wax", "leaves"])
def test_what_is_seen_to_emit_is_part_of_the_picture(ctx: moderngl.Context, name: str) -> None:
    """Also through smooth surfaces, by the same paths, so that nothing is left where nothing else is seen; and the mean
    of more samples is the same as of other ones."""
    with Renderer(load(name), SIZE, context=ctx, adaptive="off", guiding="off") as renderer:
        renderer.sample(16)
        image, seen, clean = (renderer.image(), *map(renderer.aov, DENOISING[2:4]))
        assert (image - seen).min() > -1e-5 * image.max()
        np.testing.assert_allclose(clean.mean(), seen.mean(), rtol=0.2, atol=1e-6)
        renderer.sample(48)
        np.testing.assert_array_equal(renderer.aov("denoising_emission"), clean)


def test_nothing_but_what_is_seen_to_emit(ctx: moderngl.Context) -> None:
    """A glass ball and a pane before the sky."""
    clear = {"dielectric": Material(model="dielectric", roughness=0.0)}
    clear |= {"thin-dielectric": Material(model="thin-dielectric")}
    scene = Scene(
        Camera((0, 0, 3), (0, 0, 0)),
        clear,
        spheres=[Sphere((0, 0, 0), 0.8, "dielectric")],
        planes=[Plane((0, 0, -1), (0, 0.2, 1), "thin-dielectric")],
        ambient=Ambient((1.0, 0.5, 0.25)),
    )
    with Renderer(scene, SIZE, context=ctx, russian_roulette=False, bounces=16) as renderer:
        renderer.sample(SPP)
        np.testing.assert_allclose(renderer.aov("denoising_emission"), renderer.image(), rtol=1e-4)


def test_what_a_denoiser_is_told_of_a_mirror(ctx: moderngl.Context) -> None:
    """The wall that it shows, times what it reflects; other layers are those of the mirror."""
    scene = Scene(
        Camera((0, 0, 3), (0, 0, 0), fov_degrees=20),
        {"mirror": Material(metal="gold", roughness=0.0), "wall": lambert(0.5)},
        planes=[Plane((0, 0, 0), (0, 0, 1), "mirror"), Plane((0, 0, 4), (0, 0, -1), "wall")],
        ambient=Ambient(1),
    )
    with Renderer(scene, (9, 9), context=ctx) as renderer:
        renderer.sample(4)
        gold = renderer.aov("albedo")[4, 4]
        np.testing.assert_allclose(renderer.aov("denoising_albedo")[4, 4], 0.5 * gold, rtol=0.02)
        np.testing.assert_allclose(renderer.aov("denoising_normal")[4, 4], (0, 0, -1), atol=1e-5)
        np.testing.assert_allclose(renderer.aov("normal")[4, 4], (0, 0, 1), atol=1e-5)


@pytest.mark.parametrize("opacity", [1.0, 0.5])
def test_mattes_anti_alias_as_the_picture_does(ctx: moderngl.Context, opacity: float) -> None:
    """A ball that shows 1 before black: the picture is its share of each pixel, through stochastic alpha too."""
    glow = Material(albedo=1.0, unlit=True, alpha_mode="blend", opacity=opacity)
    scene = Scene(Camera((0, 0, 3), (0, 0, 0)), {"glow": glow}, spheres=[Sphere((0, 0, 0), 1, "glow")])
    with Renderer(scene, SIZE, context=ctx) as renderer:
        renderer.sample(SPP)
        image = renderer.image()[..., 0]
        found = {name: renderer.aov(name) for name in ("object", "material")}
        assert not np.isfinite(renderer.aov("depth")[0, 0])
        assert not renderer.aov("position")[0, 0].any()
    assert len(np.unique(image)) > 5
    for name, of in (("object", "sphere[0]"), ("material", "glow")):
        np.testing.assert_allclose(found[name][..., 0, 1], image, atol=1e-6)
        np.testing.assert_array_equal(found[name][..., 0, 0][image > 0], np.float32(matte_id(of)))
        assert not found[name][..., 1:, :].any()


def test_boundaries_of_media_are_passed(ctx: moderngl.Context) -> None:
    """What lies within two of them, one empty and one a cloud, has the layers that it has alone; where it is there in
    part, its share of a pixel is that of the picture."""
    red = Material(albedo=(0.7, 0.1, 0.1))
    around = {"empty": Material(model="null"), "cloud": Material(model="null", interior="cloud", priority=1)}
    alone = Scene(Camera((0, 0, 5), (0, 0, 0)), {"ball": red}, spheres=[Sphere((0, 0, 0), 0.5, "ball")])
    spheres = (*alone.spheres, Sphere((0, 0, 0), 2, "empty"), Sphere((0, 0, 0), 1.5, "cloud"))
    clouds = {"cloud": Medium(extinction=0.1)}
    bounded = replace(alone, materials=alone.materials | around, spheres=spheres, media=clouds)
    found = []
    for scene in (alone, bounded):
        with Renderer(scene, SIZE, context=ctx) as renderer:
            renderer.sample(SPP)
            found.append({name: renderer.aov(name) for name in ("depth", "normal", "albedo", "object", "material")})
    assert np.isfinite(found[0]["depth"]).any()
    for name, layer in found[0].items():
        np.testing.assert_allclose(found[1][name], layer, rtol=1e-3, atol=1e-4, err_msg=name)
    glow = Material(albedo=1.0, unlit=True, alpha_mode="blend", opacity=0.5)
    veiled = replace(bounded, materials=bounded.materials | {"ball": glow}, spheres=spheres[:2])
    with Renderer(veiled, SIZE, context=ctx) as renderer:
        renderer.sample(SPP)
        np.testing.assert_allclose(renderer.aov("object")[..., 0, 1], renderer.image()[..., 0], atol=1e-6)


def test_mattes_name_what_is_seen(ctx: moderngl.Context) -> None:
    """Three balls in a row, from left to right."""
    balls = [Sphere((x, 0, 0), 1, name) for x, name in ((-2, "red"), (0, "green"), (2, "blue"))]
    materials = {name: Material() for name in ("blue", "green", "red")}
    scene = Scene(Camera((0, 0, 6), (0, 0, 0), fov_degrees=20.0), materials, spheres=balls)
    with Renderer(scene, (9, 3), context=ctx) as renderer:
        renderer.sample(1)
        for name, of in (("object", ["sphere[0]", "sphere[1]", "sphere[2]"]), ("material", ["red", "green", "blue"])):
            found = renderer.aov(name)[1, [1, 4, 7], 0, 0]
            np.testing.assert_array_equal(found, np.float32([matte_id(one) for one in of]))


def test_mattes_of_a_scene_cover_it(ctx: moderngl.Context) -> None:
    """Meshes and shapes, in the BVH: the shares of the names in every pixel are 1 together."""
    scene = load("still-life")
    with Renderer(scene, SIZE, context=ctx) as renderer:
        renderer.sample(8)
        for name in ("object", "material"):
            found = renderer.aov(name)
            np.testing.assert_allclose(found[..., 1].sum(axis=2), 1, atol=1e-6)
            assert (np.diff(found[..., 1], axis=2) <= 0).all()
            known = {np.float32(matte_id(one)) for one in renderer.matte_names(name)} | {np.float32(0)}
            seen = set(found[..., 0].ravel().tolist())
            assert seen <= {float(one) for one in known}
            assert len(seen) > 5
        assert {mesh.name for mesh in scene.meshes} <= set(renderer.matte_names("object"))


def test_ranks_of_a_matte() -> None:
    """The largest first, and names that occur twice are one."""
    counts = np.zeros((1, 1, 6, 2), np.float32)
    counts[0, 0, :4] = [(1, 2), (2, 5), (3, 1), (0, 0)]
    found = matte(counts, np.full((1, 1), 16, np.float32), ["tree", "wall", "tree"])
    np.testing.assert_array_equal(found[0, 0, :2, 0], np.float32([matte_id("wall"), matte_id("tree")]))
    np.testing.assert_allclose(found[0, 0, :, 1], [5 / 16, 3 / 16, 0, 0, 0, 0])


def test_ids_are_those_of_cryptomatte() -> None:
    """MurmurHash3_x86_32 by its published vectors, and no id that a float32 cannot keep."""
    vectors = {(b"", 0): 0, (b"", 1): 0x514E28B7, (b"", 0xFFFFFFFF): 0x81F16F39, (b"test", 0): 0xBA6BD213}
    vectors |= {(b"test", 0x9747B28C): 0x704B81DC, (b"Hello, world!", 0): 0xC0363E43, (b"aaa", 0x9747B28C): 0x283E0130}
    vectors |= {(b"The quick brown fox jumps over the lazy dog", 0): 0x2E4FF723}
    for (data, seed), expected in vectors.items():
        assert murmur3(data, seed) == expected
    extreme = [name for name in map(str, range(2000)) if murmur3(name.encode()) >> 23 & 255 in (0, 255)]
    assert len(extreme) > 3
    for name in extreme:
        bits = int(np.array(matte_id(name), np.float32).view(np.uint32))
        assert bits == murmur3(name.encode()) ^ 1 << 23
        assert np.isfinite(matte_id(name))
    metadata = matte_metadata("object", ["hello"])
    assert metadata["cryptomatte/3ae39a5/name"] == "CryptoObject"
    assert json.loads(metadata["cryptomatte/3ae39a5/manifest"]) == {"hello": "248bfa47"}


def test_a_file_keeps_all_layers(ctx: moderngl.Context, tmp_path: Path) -> None:
    """Bit for bit, by names that others know; the picture stays R, G and B."""
    import OpenEXR

    with Renderer(load("cornell-box"), (12, 8), context=ctx, aovs=["all"]) as renderer:
        renderer.sample(4)
        layers = {name: renderer.aov(name) for name in AOVS}
        names = {name: renderer.matte_names(name) for name in ("object", "material")}
        image = renderer.image()
    path = tmp_path / "a.exr"
    write_image(path, image, {"spp": "4"}, layers=layers, matte_names=names)
    np.testing.assert_array_equal(read_image(path), image)
    with OpenEXR.File(str(path), separate_channels=True) as file:
        found = {name: channel.pixels for name, channel in file.channels().items()}
        header = dict(file.header())
    planes = [channels(layer, values, 8, 12) for layer, values in layers.items()]
    expected = {name: plane for one in planes for name, plane in one.items()}
    assert found.keys() == {"R", "G", "B", *expected}
    for name, plane in expected.items():
        np.testing.assert_array_equal(found[name], plane, err_msg=name)
    for name in ("albedo.R", "normal.Z", "depth.Z", "CryptoObject00.A", "CryptoMaterial02.R", "motion.Y", "samples.Y"):
        assert name in found
        assert found[name].dtype == np.float32
    assert header["cryptomatte/3ae39a5/conversion"] == "uint32_to_float32"
    (again, albedo, normal), metadata = read_layers(path, ["albedo", "normal"])
    np.testing.assert_array_equal(again, image)
    np.testing.assert_array_equal(albedo, layers["albedo"])
    np.testing.assert_array_equal(normal, layers["normal"])
    assert metadata == {"spp": "4"}
    mi = pytest.importorskip("mitsuba")
    mi.set_variant(mi.variant() or "scalar_rgb")
    bitmap = mi.Bitmap(str(path))
    place = [field.name for field in bitmap.struct_()].index("position.Y")
    np.testing.assert_array_equal(np.array(bitmap)[..., place], layers["position"][..., 1])


def test_mistakes(ctx: moderngl.Context, tmp_path: Path) -> None:
    image = np.zeros((2, 2, 3), np.float32)
    with pytest.raises(FragtracerError, match="there is no layer 'normals'; the layers are: albedo, normal, "):
        checked(["albedo, normals"])
    assert checked("albedo") == ("albedo",)
    assert checked(["normal,albedo", "normal"]) == ("normal", "albedo")
    assert checked(["albedo", "all"]) == tuple(AOVS)
    assert checked(["denoising", "normal"]) == (*DENOISING, "normal")
    with pytest.raises(OutputError, match=r"a\.png: only \.exr files have layers; give a\.exr"):
        write_image(tmp_path / "a.png", image, layers={"albedo": image})
    for name, shape in (("albedo", (2, 2)), ("depth", (2, 2, 3)), ("own", (2, 3, 3)), ("object", (2, 2, 4))):
        with pytest.raises(
            OutputError, match=rf"the layer {name} is an array of \(2, 2, .*, got float64 \({shape[0]}, "
        ):
            write_image(tmp_path / "b.exr", image, layers={name: np.zeros(shape)})
    write_image(tmp_path / "a.exr", image, layers={"albedo": image})
    with pytest.raises(FragtracerError, match="it has no layer normal"):
        read_layers(tmp_path / "a.exr", ["albedo", "normal"])
    with pytest.raises(FragtracerError, match="knows no parts of the light; use path"):
        Renderer(load("furnace"), SIZE, context=ctx, integrator="split-sum", aovs=["direct"])
    with Renderer(load("furnace"), SIZE, context=ctx) as renderer:
        with pytest.raises(FragtracerError, match="there are no samples yet"):
            renderer.aov("albedo")
        renderer.sample(1)
        with pytest.raises(FragtracerError, match=r"must be asked for before: Renderer\(scene, aovs=\['direct'\]\)"):
            renderer.aov("direct")
        assert renderer.aov("samples").shape == (SIZE[1], SIZE[0])
        assert renderer.aov("standard_error").shape == (SIZE[1], SIZE[0], 3)
