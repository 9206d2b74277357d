# SPDX-License-Identifier: MIT
"""The text of a page, and what is refused."""

import base64
import gzip
import hashlib
import io
import json
import re
import struct
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import PIL.Image
import pytest

import fragtracer as ft
from fragtracer.apps import cli, web
from fragtracer.apps.web import page, payload
from fragtracer.apps.web.payload import scene_payload
from fragtracer.apps.web.smaller import with_quantised_meshes, with_smaller_images
from fragtracer.display.look import Look
from fragtracer.errors import FragtracerError, SceneError
from fragtracer.light_tracing import is_needed
from fragtracer.packing import pack
from fragtracer.packing.atlas import mean_color

CHECKOUT = Path(__file__).parents[3]
BUILT = [CHECKOUT / "src" / "fragtracer" / "apps" / "web" / name for name in ("runner.js", "widget.js")]
SIZE = (48, 32)


class Parsed(HTMLParser):
    """The elements of a page with their attributes, and the text in each."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.texts: list[tuple[str, str]] = []
        self.open: list[str] = []
        self.feed(text)
        self.close()

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, dict(attributes)))
        self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        while self.open and self.open.pop() != tag:  # those that have no end
            pass

    def handle_data(self, data: str) -> None:
        if self.open:
            self.texts.append((self.open[-1], data))


def unpacked(data: bytes) -> tuple[dict, bytes]:
    """Header and arrays of a payload."""
    whole = gzip.decompress(data)
    (length,) = struct.unpack_from("<I", whole)
    return json.loads(whole[4 : 4 + length]), whole[4 + length :]


def test_a_page_is_small_and_names_nothing_elsewhere():
    text = page(ft.load("three-spheres"), SIZE, 1).text
    assert len(text) < 200_000  # without the poster in its full size; the goal is 400 kB with it
    parsed = Parsed(text)
    for _, attributes in parsed.elements:
        for name in ("src", "href", "action"):
            assert (attributes.get(name) or "data:").startswith("data:")
    assert [tag for tag, _ in parsed.elements].count("script") == 3


def test_a_denoised_poster_says_so():
    posters = {}
    for denoise in (False, True):
        made = page(ft.load("cornell-box"), SIZE, 4, denoise=denoise)
        (image,) = (found for element, found in Parsed(made.text).elements if found.get("id") == "poster")
        assert image["alt"] == f"cornell-box, rendered{' and denoised' * denoise}"
        posters[denoise] = np.asarray(PIL.Image.open(io.BytesIO(made.poster)).convert("L"), float)
    noise = {denoise: np.abs(np.diff(poster)).mean() for denoise, poster in posters.items()}
    assert noise[True] < 0.6 * noise[False]


def test_the_policy_names_the_script_and_the_style():
    parsed = Parsed(page(ft.load("cornell-box"), SIZE, 1).text)
    (policy,) = (a["content"] for tag, a in parsed.elements if tag == "meta" and a.get("http-equiv"))
    assert policy.startswith("default-src 'none';")
    assert "unsafe" not in policy
    script = [text for tag, text in parsed.texts if tag == "script"][-1]
    (style,) = (text for tag, text in parsed.texts if tag == "style")
    for kind, text in (("script", script), ("style", style)):
        digest = base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()
        assert re.search(rf"{kind}-src 'sha256-{re.escape(digest)}'", policy)


def test_a_name_is_text_wherever_it_stands():
    name = "</script><script>alert(1)</script>\"'><img src=x onerror=alert(1)>&amp;${name}"
    parsed = Parsed(page(replace(ft.load("cornell-box"), name=name), SIZE, 1).text)
    assert [tag for tag, _ in parsed.elements].count("script") == 3
    assert [a["id"] for tag, a in parsed.elements if tag == "img"] == ["poster"]
    assert "".join(text for tag, text in parsed.texts if tag == "h1").strip() == name


@pytest.mark.parametrize("name", ["grille", "overcast", "cornell-box"])
def test_the_arrays_are_those_of_the_desktop(name):
    """Of each kind of device: fewer shapes are tested one by one on a GPU."""
    scene = ft.load(name)
    header, data = unpacked(scene_payload(scene, scene.render, Look()))
    assert ("software" in header) == (name == "cornell-box")
    for stored, most_listed in ((header, 8), (header.get("software", header), 64)):
        packed = pack(scene, scene.render, scene.render.width, scene.render.height, most_listed)
        names = {name for name, parts in packed.tables.items() if any(map(len, parts))}
        assert {table["name"] for table in stored["tables"]} == names
        for table in stored["tables"]:
            for part, expected in zip(table["parts"], packed.tables[table["name"]], strict=True):
                found = np.frombuffer(data, np.uint8, part["length"], part["offset"])
                if part["stride"]:
                    found = found.reshape(part["stride"], -1).T
                assert found.tobytes() == expected.tobytes()


def test_a_size_is_that_of_its_sphere_beside_a_grid():
    scene = ft.load("sphere-field")
    lamp = ft.Sphere((0, 5, 0), 0.75, "lamp")
    materials = {**scene.materials, "lamp": ft.Material(emission=(5, 5, 5))}
    scene = replace(scene, materials=materials, spheres=(*scene.spheres, lamp))
    header, data = unpacked(scene_payload(scene, scene.render, Look()))
    (table,) = (table for table in header["tables"] if table["name"] == "u_shapes")
    part = table["parts"][0]
    shapes = np.frombuffer(data, np.uint8, part["length"], part["offset"])
    shapes = (shapes.reshape(part["stride"], -1).T if part["stride"] else shapes).copy().view(np.float32).ravel()
    (size,) = (control for control in header["controls"] if control["id"].startswith("size-"))
    assert [shapes[t["word"]] for t in size["targets"] if t.get("table") == "u_shapes"] == [0.75]


BASE = {"albedo", "roughness", "metallic"}
LAYERS = [
    ({}, {"albedo"}),
    ({"coat": 0.5}, {*BASE, "coat", "coat_roughness"}),
    ({"sheen_color": (0.5, 0.25, 0.0)}, {*BASE, "sheen", "sheen_roughness"}),
    ({"iridescence": 0.5}, {*BASE, "iridescence", "film_thickness"}),
    ({"diffuse_transmission": 0.5}, {"albedo", "roughness", "diffuse_transmission"}),
]


@pytest.mark.parametrize(("layer", "found"), LAYERS, ids=["bare", "coat", "sheen", "film", "translucent"])
def test_what_of_a_lambert_base_can_be_changed(layer, found):
    """Under a layer, or where it transmits, it is of a program that has a specular lobe, and these are what the scene
    with their values would have."""
    base = {"plain": ft.Material(coat=0.75), "base": ft.Material(specular=0.0, **layer)}
    spheres = [ft.Sphere((0, 0, 0), 1, name) for name in base]
    scene = ft.Scene(materials=base, spheres=spheres, ambient=ft.Ambient(1.0))
    controls = payload.controls_by_name(scene, scene.render, Look())
    assert {name.removesuffix("-1") for name in controls if name.endswith("-1")} == found
    if "sheen" in found:
        (target,) = controls["sheen-1"]["targets"]
        words = pack(scene, scene.render, 8, 8).tables["u_scene"][0].view(np.float32).flat
        assert (
            [words[target["word"] + i] for i in range(3)]
            == [0.5 * share for share in target["value"]]
            == [0.5, 0.25, 0]
        )
    for name in found & {"coat", "coat_roughness", "sheen_roughness", "iridescence", "diffuse_transmission"}:
        (target,) = controls[f"{name}-1"]["targets"]
        edited = replace(scene, materials=base | {"base": replace(base["base"], **{name: 0.625})})
        words = [pack(s, s.render, 8, 8).tables["u_scene"][0].view(np.float32).flat for s in (scene, edited)]
        assert [of[target["word"]] for of in words] == [controls[f"{name}-1"]["value"], 0.625]
        assert target["value"] == [1.0]


def test_the_runner_is_built_from_its_sources():
    """Else: npm ci && npm run build in web/."""
    sources = sorted((CHECKOUT / "web" / "src").iterdir())
    digest = hashlib.sha256(b"".join(path.read_bytes() for path in sources)).hexdigest()
    for text in (path.read_text(encoding="utf-8") for path in BUILT):
        assert f"built from web/src {digest} " in text.splitlines()[0]
        assert "</script" not in text


def test_a_scene_beyond_a_texture_is_refused(monkeypatch):
    monkeypatch.setattr(payload, "_MOST_ROWS", 2)
    scene = ft.load("knot")
    with pytest.raises(SceneError, match=r"shapes and meshes take 1 MB; a texture in a browser holds 0 MB: use fewer"):
        scene_payload(scene, scene.render, Look())


def test_an_approximation_is_refused():
    scene = ft.load("overcast")
    for changes in ({"integrator": "split-sum"}, {"background": "irradiance"}):
        with pytest.raises(SceneError, match="a page traces paths"):
            scene_payload(scene, replace(scene.render, **changes), Look())


def caustic() -> ft.Scene:
    """What a glass ball throws onto a floor below a light without a size."""
    materials = {"floor": ft.Material(specular=0), "glass": ft.Material(model="dielectric", roughness=0)}
    floor, ball = ft.Plane((0, 0, 0), (0, 1, 0), "floor"), ft.Sphere((0, 0.6, 0), 0.5, "glass")
    return ft.Scene(materials=materials, planes=(floor,), spheres=(ball,), lights=(ft.Light((0, 3, 1), power=100),))


def test_what_the_live_picture_lacks_is_said():
    """What paths meet is not: rough glass, a light with a size; nor what the poster does not have either."""
    scene = caustic()
    (light,) = scene.lights
    rough = replace(scene, materials=scene.materials | {"glass": ft.Material(model="dielectric", roughness=0.3)})
    for case, lacks in (
        (scene, True),
        (replace(scene, lights=(), directional_lights=(ft.DirectionalLight((0, -1, 0), 1),)), True),
        (rough, False),
        (replace(scene, lights=(replace(light, radius=0.1),)), False),
        (replace(scene, spheres=()), False),
    ):
        assert is_needed(case, case.render) == lacks
    for light_tracing in ("auto", "off"):
        made = page(replace(scene, render=replace(scene.render, light_tracing=light_tracing)), SIZE, 1)
        said = "he live picture lacks what lights without a size throw through smooth glass"
        assert [said in note for note in made.notes] == [True] * (light_tracing == "auto")
        assert (f'<p id="lacks">T{said}' in made.text) == (light_tracing == "auto")


def test_a_page_is_made_as_small_as_asked_for(monkeypatch):
    scene = ft.load("leaves")
    whole = page(scene, SIZE, 1)
    assert whole.notes == []
    made = page(scene, SIZE, 1, size_limit=int(0.7 * len(whole.text)))
    assert len(made.text) <= 0.7 * len(whole.text)
    assert [re.sub(r"\d+", "N", note) for note in made.notes] == [
        "to keep it small, images have N texels a side at most",
        "to keep it small, vertices of meshes lie on a grid of N^N steps",
    ]
    noise = np.random.default_rng(1).random((128, 256, 3))
    made = page(ft.Scene(environment=ft.Environment(image=ft.Panorama(noise))), SIZE, 1, size_limit="250kB")
    assert made.notes == ["to keep it small, images have 64 texels a side at most"]
    monkeypatch.delattr(web, "Renderer")  # refused before the work
    with pytest.raises(SceneError, match=r"the page takes \d+ kB at least; the limit is 1 kB"):
        page(ft.load("cornell-box"), SIZE, 1, size_limit=1000)


def test_smaller_images_have_the_same_mean_and_vertices_move_by_half_a_step():
    scene = ft.load("grille")
    smaller, side = with_smaller_images(scene, 2)
    images = [t.image for m in scene.materials.values() for t in m.textures.values()]
    found = [t.image for m in smaller.materials.values() for t in m.textures.values()]
    assert side == max(max(image.pixels.shape[:2]) for image in images) // 4
    for image, other in zip(images, found, strict=True):
        np.testing.assert_allclose(mean_color(other), mean_color(image), atol=0.01)
    noise = np.random.default_rng(1).random((32, 64, 3)) ** 8
    scene = ft.Scene(environment=ft.Environment(image=ft.Panorama(noise)))
    smaller, side = with_smaller_images(scene, 2)
    assert side == 16
    assert smaller.environment.image.pixels.shape == (8, 16, 3)
    np.testing.assert_allclose(smaller.environment.image.pixels.mean(axis=(0, 1)), noise.mean(axis=(0, 1)), rtol=1e-5)
    scene = ft.load("knot")
    for mesh, other in zip(scene.meshes, with_quantised_meshes(scene, 10).meshes, strict=True):
        for part, coarse in zip(mesh.parts, other.parts, strict=True):
            moved = np.abs(part.geometry.positions - coarse.geometry.positions).max()
            assert 0 < moved <= np.ptp(part.geometry.positions, axis=0).max() / 2**10


def test_parts_of_a_mesh_that_meet_still_do_on_a_coarser_grid():
    """The smallest of them says how coarse it is, in the space of the mesh."""
    ends = np.array([(1 / 3, 0, 0.1), (1 / 3, 1 / 7, 0.1)])
    wide, narrow = (ft.Geometry(np.vstack([ends, [(1 / 3 + side, 0, 0)]]), [(0, 1, 2)]) for side in (-9.7, 0.3))
    far = ft.Geometry([(0, 0, 0), (0.01, 0, 0), (0.01, 0.003, 0)], [(0, 1, 2)])
    moved, enlarged = np.eye(4), np.diag([1000.0, 1000, 1000, 1])
    moved[:3, 3] = 5, 0, 0
    parts = [
        *(ft.Part(geometry, "white", matrix) for matrix in (np.eye(4), moved) for geometry in (wide, narrow)),
        ft.Part(far, "white", enlarged),
    ]
    scene = ft.Scene(meshes=(ft.Mesh(parts),), materials={"white": ft.Material()})
    coarse = [part.geometry for part in with_quantised_meshes(scene, 6).meshes[0].parts]
    np.testing.assert_array_equal(coarse[0].positions[:2], coarse[1].positions[:2])
    assert coarse[:2] == coarse[2:4]
    for part, geometry in zip(parts, coarse, strict=True):
        shift = np.abs(part.geometry.positions - geometry.positions).max() * part.matrix[0][0]
        assert 0 < shift <= 0.3 / 2**6


def test_a_scene_shows_itself_in_a_notebook():
    class Frame(HTMLParser):
        def handle_starttag(self, tag, attributes):
            assert tag == "iframe"
            self.page = dict(attributes)["srcdoc"]

    scene = ft.load("cornell-box")
    shown = ft.show(replace(scene, name="<b>"), SIZE, 1)
    frame = Frame()
    frame.feed(shown._repr_html_())
    assert frame.page == shown.text
    bright = ft.show(scene, SIZE, 1, exposure=1.5, tonemap="agx")
    assert bright.look == Look(1.5, "agx")
    assert bright.settings == shown.settings
    assert "_repr_html_" in dir(scene)


def test_a_renderer_shows_its_picture_in_a_notebook():
    with ft.Renderer(ft.load("cornell-box"), SIZE) as renderer:
        renderer.sample(1)
        picture = np.asarray(PIL.Image.open(io.BytesIO(renderer._repr_png_())))
        expected = 255 * Look("auto").show(renderer.image())
    np.testing.assert_allclose(picture, expected, atol=0.51)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["cornell-box", "missing/page.html"], "there is no folder"),
        (["cornell-box", "page.png"], "cannot write .png"),
        (["no-such-scene", "page.html"], "no-such-scene"),
        (["cornell-box", "page.html", "--size-limit", "5"], "give a number of kB or MB"),
        (["cornell-box", "page.html", "--fallback", "0x9,3"], "give width, height and number of pictures"),
        (["cornell-box", "page.html", "--exposure", "bright"], "give a number of stops"),
        (["cornell-box", "page.html", "--size", "16384x1"], "each from 1 to 16383"),
    ],
)
def test_bad_input_is_one_sentence(arguments, message, monkeypatch, capsys, tmp_path):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.argv", ["fragtracer", "export-html", *arguments])
    with pytest.raises(SystemExit) as ended:
        cli.main()
    assert ended.value.code == 2
    error = capsys.readouterr().err
    assert message in error
    assert "Traceback" not in error
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"path": None}, "^None: "),
        ({"size": (1, 16384)}, "each from 1 to 16383"),
        ({"spp": 1.5}, r"^spp = 1\.5: "),
        ({"seconds": float("nan")}, "^seconds = nan: give a number of seconds, not negative$"),
        ({"seconds": "5"}, "^seconds = '5': "),
        ({"size_limit": "5"}, "^size limit '5': give a number of kB or MB"),
        ({"size_limit": -5}, "^size limit -5: "),
        ({"fallback": (8, 8)}, r"^fallback = \(8, 8\): give width, height and number of pictures"),
        ({"fallback": (0, 0, 0)}, r"^fallback = \(0, 0, 0\): "),
        ({"fallback": (8, 16384, 1)}, "^fallback = "),
    ],
)
def test_bad_arguments_are_one_sentence_before_the_work(arguments, message, monkeypatch, tmp_path):
    monkeypatch.delattr(web, "Renderer")
    with pytest.raises(FragtracerError, match=message):
        ft.export_html(**{"scene": ft.load("cornell-box"), "path": tmp_path / "page.html", **arguments})
