# SPDX-License-Identifier: MIT
"""OBJ and MTL files: what they can hold is read right, and what is wrong with them is said with its line."""

import errno
import os
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import PIL.Image
import pytest

from fragtracer.errors import SceneError
from fragtracer.io import Model, bounds, read_model
from fragtracer.scene import Material

from .data import shared

SQUARE = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"


def read(folder: Path, text: str, mtl: str | None = None) -> Model:
    (folder / "x.obj").write_text(text)
    if mtl is not None:
        (folder / "x.mtl").write_text(mtl)
    return read_model(folder / "x.obj")


def area(model: Model) -> float:
    total = 0.0
    for part in model.mesh.parts:
        a, b, c = (part.geometry.positions[part.geometry.triangles[:, i]] for i in range(3))
        total += float(np.cross(b - a, c - a)[:, 2].sum()) / 2
    return total


@pytest.mark.parametrize("face", ["1 2 3 4", "-4 -3 -2 -1", "1// 2// 3// 4//", "1 \\\n 2 3 \\\n4"])
def test_quads(tmp_path: Path, face: str) -> None:
    model = read(tmp_path, f"{SQUARE}f {face}\n")
    [part] = model.mesh.parts
    assert len(part.geometry.triangles) == 2
    assert area(model) == pytest.approx(1)
    assert part.geometry.normals is None
    assert part.geometry.uvs is None


def test_negative_indices_count_from_the_face(tmp_path: Path) -> None:
    model = read(tmp_path, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\nv 5 0 0\nv 7 0 0\nv 5 1 0\nf -3 -2 -1\n")
    assert area(model) == pytest.approx(0.5 + 1)


@pytest.mark.parametrize("shift", range(6))
@pytest.mark.parametrize("turn", [1, -1])
@pytest.mark.parametrize("scale", [1e-6, 1, 1e6])
def test_concave_polygons(tmp_path: Path, shift: int, turn: int, scale: float) -> None:
    outline = [(0, 0), (3, 0), (3, 1), (1, 1), (1, 2), (0, 2)]
    outline = (outline[shift:] + outline[:shift])[::turn]
    lines = [f"v {scale * x} {scale * y} {scale * 0.5}" for x, y in outline]
    assert area(read(tmp_path, "\n".join([*lines, "f 1 2 3 4 5 6"]))) == pytest.approx(turn * 4 * scale**2)


def outline(radii: np.ndarray) -> str:
    angles = 2 * np.pi * np.arange(len(radii)) / len(radii)
    lines = [f"v {r * np.cos(a)} {r * np.sin(a)} 1" for r, a in zip(radii, angles, strict=True)]
    return "\n".join([*lines, "f " + " ".join(map(str, range(1, len(radii) + 1)))])


@pytest.mark.parametrize("doubled", range(5))
@pytest.mark.parametrize("scale", [1e-6, 1, 1e6])
def test_concave_polygons_with_a_corner_given_twice(tmp_path: Path, doubled: int, scale: float) -> None:
    points = [(0, 0), (4, 0), (4, 4), (2, 1), (0, 4)]
    points.insert(doubled, points[doubled])
    text = "".join(f"v {scale * x} {scale * y} {scale * 3}\n" for x, y in points)
    [part] = read(tmp_path, f"{text}f {' '.join(map(str, range(1, 7)))}\n").mesh.parts
    a, b, c = (part.geometry.positions[part.geometry.triangles[:, i]] / scale for i in range(3))
    areas = np.cross(b - a, c - a)[:, 2] / 2
    assert (areas >= 0).all()
    x, y = np.transpose(points)
    assert areas.sum() == pytest.approx(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)) / 2)


def test_large_polygons(tmp_path: Path) -> None:
    """Convex ones of any size; concave ones up to where cutting them would take long."""
    assert area(read(tmp_path, outline(np.ones(20000)))) == pytest.approx(np.pi, rel=1e-6)
    star = 1 - np.arange(4096) % 2 / 2
    assert area(read(tmp_path, outline(star))) == pytest.approx(2048 * 0.5 * np.sin(2 * np.pi / 4096))
    with pytest.raises(SceneError, match="a concave face has 4098 vertices; split it into faces of at most 4096"):
        read(tmp_path, outline(1 - np.arange(4098) % 2 / 2))


def test_a_star_that_turns_twice_is_not_taken_for_convex(tmp_path: Path) -> None:
    points = [(np.cos(4 * np.pi * i / 5), np.sin(4 * np.pi * i / 5)) for i in range(5)]
    model = read(tmp_path, "\n".join([*(f"v {x} {y} 0" for x, y in points), "f 1 2 3 4 5"]))
    [part] = model.mesh.parts
    a, b, c = (part.geometry.positions[part.geometry.triangles[:, i]] for i in range(3))
    assert (np.cross(b - a, c - a)[:, 2] > 0).all()


@pytest.mark.parametrize("shift", range(4))
@pytest.mark.parametrize("turn", [1, -1])
def test_concave_quads(tmp_path: Path, shift: int, turn: int) -> None:
    outline = [(0, 0), (4, 0), (1, 1), (0, 4)]
    outline = (outline[shift:] + outline[:shift])[::turn]
    model = read(tmp_path, "\n".join([*(f"v {x} {y} 0" for x, y in outline), "f 1 2 3 4"]))
    a, b, c = (model.mesh.parts[0].geometry.positions[model.mesh.parts[0].geometry.triangles[:, i]] for i in range(3))
    areas = np.cross(b - a, c - a)[:, 2] / 2 * turn
    assert areas.sum() == pytest.approx(4)
    assert (areas > 0).all()


def test_coordinates_and_normals(tmp_path: Path) -> None:
    text = SQUARE + "vt 0 0\nvt 1 0.25\nvt 0 1\nvn 0 0 2\nvn 0 1 1\nf 1/1/1 2/2/1 3/3/2\nf 1//1 3//1 4//2\nf 1 2 4\n"
    model = read(tmp_path, text)
    both, normals_only, plain = (
        next(p.geometry for p in model.mesh.parts if (p.geometry.uvs is None, p.geometry.normals is None) == kind)
        for kind in ((False, False), (True, False), (True, True))
    )
    assert both.uvs is not None
    assert both.normals is not None
    np.testing.assert_allclose(both.uvs[both.triangles[0]], [[0, 1], [1, 0.75], [0, 0]])
    np.testing.assert_allclose(both.normals[both.triangles[0]], [[0, 0, 2], [0, 0, 2], [0, 1, 1]])
    assert len(normals_only.triangles) == len(plain.triangles) == 1


def test_groups_by_material(tmp_path: Path) -> None:
    mtl = "newmtl a\nKd 1 0 0\nnewmtl long name\nKd 0 .5 0\n"
    faces = "usemtl a\nf 1 2 3\nusemtl long name\nf 1 3 4\nusemtl a\nf 2 3 4\n"
    model = read(tmp_path, f"mtllib x.mtl\n{SQUARE}{faces}", mtl)
    assert [(part.material, len(part.geometry.triangles)) for part in model.mesh.parts] == [("a", 2), ("long name", 1)]
    assert model.materials["long name"].albedo == (0, 0.5, 0)
    assert not model.ignored


def test_materials(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    PIL.Image.fromarray(rng.integers(0, 255, (2, 2, 3)).astype(np.uint8)).save(tmp_path / "my wood.png")
    PIL.Image.fromarray(rng.integers(0, 255, (2, 2)).astype(np.uint8)).save(tmp_path / "mask.png")
    mtl = """
        newmtl phong
        Kd 0.1 0.2 0.3
        Ks 0.5 0.5 0.5
        Ns 30
        Ni 1.45
        Ke 0 2 0
        d 0.25
        newmtl pbr
        Kd 1 1 1
        Pr 0.3
        Pm 0.9
        map_Kd -s 2 3 -o 0.5 0 my wood.png
        map_Pr mask.png
        norm my wood.png
        newmtl matte
        Kd 0.5 0.5 0.5
        illum 1
        Tr 0.5
        newmtl masked
        map_Kd my wood.png
        map_d mask.png
        newmtl lost
        map_Kd none.png
        Ps 0.5
        Ks 2 1 1
        refl sky.png
    """
    names = ("phong", "pbr", "matte", "masked", "lost")
    faces = "".join(f"usemtl {name}\nf 1 2 3\n" for name in names)
    notes = r"refl in .mtl, ks in .mtl above 1 \(taken as 1\), image none.png: "
    with pytest.warns(UserWarning, match=notes):
        model = read(tmp_path, f"mtllib x.mtl\n{SQUARE}{faces}", mtl)
    phong, pbr, matte, masked, lost = (model.materials[name] for name in names)
    assert phong == Material(
        albedo=(0.1, 0.2, 0.3),
        specular=0.5,
        roughness=(2 / 32) ** 0.25,
        ior=1.45,
        emission=(0, 2, 0),
        opacity=0.25,
        alpha_mode="blend",
    )
    assert (pbr.roughness, pbr.metallic) == (0.3, 0.9)
    assert pbr.albedo_texture is not None
    assert (pbr.albedo_texture.scale, pbr.albedo_texture.offset) == ((2, 3), (0.5, -2))
    assert pbr.albedo_texture.image.color_space == "srgb"
    assert pbr.roughness_texture is not None
    assert pbr.normal_texture is not None
    assert pbr.normal_texture.image.color_space == "linear"
    assert (matte.specular, matte.opacity, matte.alpha_mode) == (0, 0.5, "blend")
    assert masked.albedo_texture is not None
    assert masked.albedo_texture.image.pixels.shape == (2, 2, 4)
    assert masked.alpha_mode == "blend"
    assert lost.albedo_texture is None
    assert (lost.sheen_color, lost.sheen_roughness) == ((0.5, 0.5, 0.5), 0.5)


@pytest.mark.parametrize(
    ("lines", "said"),
    [
        ("Kd 0 0 0\nKs 1 .7 .2\nNs 100\nillum 2", {"f0": (1, 0.7, 0.2), "roughness": (2 / 102) ** 0.25}),  # gold
        ("Kd 0 0 0\nKs .9 .9 .9\nNi 1.5\nillum 3", {"f0": (0.9, 0.9, 0.9), "roughness": 0, "ior": None}),  # a mirror
        ("Kd 0 0 0\nKs .4 .4 .4\nillum 2", {"f0": None, "specular": 0.4}),  # black rubber
        ("Kd 1 0 0\nKs .5 1 1", {"f0": (0.02, 0.04, 0.04), "specular": 1, "albedo": (1, 0, 0)}),
        (
            "Kd 0 0 0\nKs 1 1 1\nTf 1 .5 1\nNi 1.33\nd .1\nillum 7",
            {"model": "dielectric", "ior": 1.33, "roughness": 0, "transmittance": (1, 0.5, 1), "alpha_mode": "opaque"},
        ),
        ("Kd .8 .8 .8\nKs 0 0 0\nNi 1.5\nillum 7", {"model": "metallic-roughness", "albedo": (0.8, 0.8, 0.8)}),
        (
            "Ns 360\nKa .9 .9 .9\nKd .8 .6 .2\nKs .25 .25 .25\nNi 1.45\nillum 3\n# Blender",
            {"roughness": 0.4, "metallic": 0.9, "specular": 0.5, "ior": 1.45, "f0": None},
        ),
        ("Ns 360\nKs .5 .5 .5\nPr .3\nPs 0\naniso 0\nillum 2\n# Blender", {"roughness": 0.3, "specular": 1}),
    ],
)
def test_what_materials_reflect_and_refract(tmp_path: Path, lines: str, said: dict[str, Any]) -> None:
    head = "# Blender 4.2.0 MTL File\n" if "Blender" in lines else ""
    model = read(tmp_path, f"mtllib x.mtl\n{SQUARE}usemtl a\nf 1 2 3\n", f"{head}newmtl a\n{lines}\n")
    assert {name: getattr(model.materials["a"], name) for name in said} == {
        name: value if isinstance(value, str | None) else pytest.approx(value) for name, value in said.items()
    }
    assert not model.ignored


@pytest.mark.parametrize(
    ("lines", "coat"),
    [
        ("Pc 0.5\nPcr 0.25", {"coat": 0.5, "coat_roughness": 0.25}),
        ("Pc 1.5 # thick", {"coat": 1.0}),
        ("Pc 0\nPcr 0.03", {}),
        ("Pcr 0.03", {}),
    ],
)
def test_a_coat(tmp_path: Path, lines: str, coat: dict[str, float]) -> None:
    model = read(tmp_path, f"mtllib x.mtl\nusemtl red\n{SQUARE}f 1 2 3\n", f"newmtl red\nPr 0.3\n{lines}\n")
    assert model.materials["red"] == Material(roughness=0.3, **coat)
    assert not model.ignored


def test_a_missing_library_is_said_in_a_line(tmp_path: Path) -> None:
    with pytest.warns(UserWarning, match=r"x\.obj: ignored: x\.mtl \(no such file; its materials are grey\)$"):
        model = read(tmp_path, f"mtllib x.mtl\nusemtl red\n{SQUARE}f 1 2 3\n")
    assert model.materials == {"red": Material()}


def test_libraries_with_spaces_and_several_in_a_line(tmp_path: Path) -> None:
    (tmp_path / "my b.mtl").write_text("newmtl\tb\n\tKd\t0 1 0\n")
    (tmp_path / "c.mtl").write_text("newmtl c\r\nKd 0.25 # grey\r\n")
    faces = "usemtl a\nf 1 2 3\nusemtl b\nf 1 2 3\nusemtl c\nf 1 2 3\n"
    model = read(tmp_path, f"mtllib x.mtl c.mtl\nmtllib my b.mtl\n{SQUARE}{faces}", "newmtl a\nKd 1 0 0\n")
    assert [model.materials[name].albedo for name in "abc"] == [(1, 0, 0), (0, 1, 0), (0.25, 0.25, 0.25)]


@pytest.mark.parametrize("color", ["xyz 0.1 0.2 0.3", "spectral a.rfl 1", "spectral a.rfl", "0.1 0.2 blue"])
def test_colors_that_are_not_rgb_are_ignored(tmp_path: Path, color: str) -> None:
    text = f"newmtl a\nKd {color}\nKe {color}\n"
    made = read(tmp_path, SQUARE + "mtllib x.mtl\nusemtl a\nf 1 2 3\n", text).materials["a"]
    assert (made.albedo, made.emission) == ((0.5, 0.5, 0.5), (0, 0, 0))


def test_many_groups(tmp_path: Path) -> None:
    faces = "".join(f"usemtl {i}\nf 1 2 3\n" for i in range(3000))
    with pytest.warns(UserWarning, match="and 2988 more$"):
        model = read(tmp_path, SQUARE + faces)
    assert len(model.mesh.parts) == 3000


@pytest.mark.parametrize("row", ["1 0 0.5", "255 0 127.5", "255 0 128"])
def test_vertex_colors_are_srgb(tmp_path: Path, row: str) -> None:
    model = read(tmp_path, f"v 0 0 0 {row}\nv 1 0 0 {row}\nv 0 1 0 {row}\nf 1 2 3\n")
    blue = {"1 0 0.5": 0.21404, "255 0 127.5": 1, "255 0 128": 0.215861}[row]
    np.testing.assert_allclose(model.mesh.parts[0].geometry.colors, [[1, 0, blue]] * 3, atol=1e-5)
    assert model.materials["default"].albedo == (1, 1, 1)


def test_degenerate_triangles_and_short_faces(tmp_path: Path) -> None:
    with pytest.warns(UserWarning, match=r"points, lines and curves, faces of fewer than three vertices \(2\)$"):
        model = read(tmp_path, SQUARE + "f 1 1 2\nf 1 2 3\nf\nf 1 2\nl 1 2\n" + "f 1 1 1 1 1\n")
    assert area(model) == pytest.approx(0.5)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "there are no faces"),
        (SQUARE, "there are no faces"),
        ("f 1 2 3\n", "line 1: v 1 does not exist; there are 0, counted from 1"),
        (SQUARE + "f 1 2 5\n", "line 5: v 5 does not exist; there are 4"),
        (SQUARE + "f 1 2 -5\n", "line 5: v -5 does not exist; there are 4"),
        (SQUARE + "vt 0 0\nf 1/-1 2/-1 3/-2\n", "line 6: vt -2 does not exist; there are 1"),
        (SQUARE + "vn 0 0 1\nf 1//-1 2//-1 3//-2\n", "line 6: vn -2 does not exist; there are 1"),
        (SQUARE + "f 0 1 2\n", "line 5: v 0 does not exist"),
        (SQUARE + "f 1/1 2/1 3/1\n", "line 5: vt 1 does not exist; there are 0"),
        (SQUARE + "f 1 2 x\n", "line 5: these are no vertices of a face: 1 2 x"),
        (SQUARE + "f 1 2 " + "9" * 400 + "\n", "line 5: these are no vertices of a face"),
        (SQUARE + "f 1 2 9999999999\n", "line 5: v 9999999999 does not exist"),
        ("v 0 0\nf 1 1 1\n", "line 1: v needs 3 numbers, got 0 0"),
        ("v 0 0 x\nf 1 1 1\n", "line 1: v needs 3 numbers, got 0 0 x"),
        (SQUARE + "v nan 0 0\nf 1 2 3\n", "line 5: v must be of finite numbers"),
        (SQUARE + "v 1e39 0 0\nf 1 2 5\n", "positions must be finite, and none beyond"),
        (SQUARE + "v 1e20 0 0\nf 1 2 5\n", "this model has bounds of 1e+20 m; scale it to less than 1e+15 m"),
        ("\0\1\2", "there are no faces"),
        (SQUARE + "f 1 2 1 2 1\n", "no face in this file has an area"),
        (SQUARE + "f 1 2 1\nf 3 3 4\n", "no face in this file has an area"),
    ],
)
def test_mistakes_are_named(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(SceneError) as raised:
        read(tmp_path, text)
    assert str(raised.value).startswith(f"{tmp_path / 'x.obj'}: ")
    assert message in str(raised.value)
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize(
    ("group", "face", "is_said"),
    [("1", "1 2 3", True), ("off", "1 2 3", False), ("0", "1 2 3", False), ("1", "1//1 2//1 3//1", False)],
)
def test_smoothing_groups_are_not_dropped_silently(tmp_path: Path, group: str, face: str, is_said: bool) -> None:
    (tmp_path / "x.obj").write_text(f"{SQUARE}vn 0 0 1\ns {group}\nf {face}\n")
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        read_model(tmp_path / "x.obj")
    assert [str(w.message).partition("ignored: ")[2] for w in caught] == [
        "smoothing groups (what has no normals is flat)"
    ] * is_said


def test_comments_behind_numbers(tmp_path: Path) -> None:
    text = "v 0 0 0 # first\nv 1 0 0 #\nv 0 1 0# third\nvt 0 0 # 1\nusemtl a#1\nf 1/1 2/1 3/1 # the only one\n"
    with pytest.warns(UserWarning, match='material "a#1"'):
        [part] = read(tmp_path, text).mesh.parts
    np.testing.assert_array_equal(part.geometry.positions, [[0, 0, 0], [1, 0, 0], [0, 1, 0]])
    assert part.material == "a#1"


def test_text_of_old_programs(tmp_path: Path) -> None:
    """Names in Latin-1 find their files, names in UTF-8 too; UTF-16 is told."""
    PIL.Image.new("RGB", (1, 1), (255, 0, 0)).save(tmp_path / "Töne.png")
    (tmp_path / "Möbel.mtl").write_bytes("newmtl Tür\nmap_Kd Töne.png\n".encode("latin-1"))
    for encoding in ("latin-1", "utf-8", "utf-8-sig"):
        text = SQUARE + f"# {encoding}\r\nmtllib Möbel.mtl\r\nusemtl Tür\r\nf 1 2 3\r\n"
        (tmp_path / "x.obj").write_bytes(text.encode(encoding))
        model = read_model(tmp_path / "x.obj")
        assert model.materials["Tür"].albedo_texture is not None
    (tmp_path / "x.obj").write_bytes(text.encode("utf-16"))
    with pytest.raises(SceneError, match="this is UTF-16 text; save it as UTF-8"):
        read_model(tmp_path / "x.obj")


@pytest.mark.parametrize("name", ["C:\\\\me\\\\maps\\\\p.png", "/home/nobody/maps/p.png", "maps/p.png", "../p.png"])
def test_pictures_of_another_machine_are_found_beside(tmp_path: Path, name: str) -> None:
    (tmp_path / "obj").mkdir()
    PIL.Image.new("RGB", (1, 1)).save(tmp_path / "obj" / "p.png")
    model = read(tmp_path / "obj", SQUARE + "mtllib x.mtl\nusemtl a\nf 1 2 3\n", f"newmtl a\nmap_Kd {name}\n")
    assert model.materials["a"].albedo_texture is not None
    PIL.Image.new("RGB", (2, 2)).save(tmp_path / "p.png")  # a path that leads somewhere is followed
    (tmp_path / "obj" / "x.obj").touch()
    texture = read_model(tmp_path / "obj" / "x.obj").materials["a"].albedo_texture
    assert texture is not None
    assert texture.image.pixels.shape[0] == (2 if name == "../p.png" else 1)


def test_a_picture_whose_path_the_system_refuses_is_ignored(tmp_path: Path) -> None:
    text = f"newmtl a\nKd 0.1 0.2 0.3\nmap_Kd {'x' * 300}.png\n"
    with pytest.warns(UserWarning, match=r"ignored: image x{300}\.png: cannot read this texture: "):
        model = read(tmp_path, SQUARE + "mtllib x.mtl\nusemtl a\nf 1 2 3\n", text)
    assert model.materials["a"] == Material(albedo=(0.1, 0.2, 0.3), specular=0.0, roughness=1.0)


def test_a_picture_in_a_folder_that_may_not_be_read_is_found_beside(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def stat(path: Any, *args: Any, **more: Any) -> os.stat_result:
        if str(path).startswith("/locked"):
            raise PermissionError(errno.EACCES, "Permission denied", str(path))
        return status(path, *args, **more)

    status = os.stat
    monkeypatch.setattr(os, "stat", stat)
    PIL.Image.new("RGB", (1, 1)).save(tmp_path / "p.png")
    model = read(tmp_path, SQUARE + "mtllib x.mtl\nusemtl a\nf 1 2 3\n", "newmtl a\nmap_Kd /locked/p.png\n")
    assert model.materials["a"].albedo_texture is not None


@pytest.mark.parametrize("picture", ["L", "LA", "RGB", "RGBA"])
@pytest.mark.parametrize("mask", ["L", "LA", "RGB", "RGBA"])
def test_masks_of_every_kind(tmp_path: Path, picture: str, mask: str) -> None:
    for name, mode, first in (("p.png", picture, 10), ("m.png", mask, 50)):
        pixel = tuple(range(first, first + 10 * len(mode), 10))
        PIL.Image.fromarray(np.full((2, 2, len(mode)), pixel, np.uint8).squeeze()).save(tmp_path / name)
    (tmp_path / "x.mtl").write_text("newmtl a\nmap_Kd p.png\nmap_d m.png\n")
    model = read(tmp_path, SQUARE + "mtllib x.mtl\nusemtl a\nf 1 2 3\n")
    texture = model.materials["a"].albedo_texture
    assert texture is not None
    colors = (10, 20, 30) if picture.startswith("RGB") else (10, 10, 10)
    alpha = {"L": 50, "LA": 60, "RGB": 50, "RGBA": 80}[mask]
    np.testing.assert_array_equal(texture.image.pixels[0, 0], [*colors, alpha])
    assert model.materials["a"].alpha_mode == "blend"


@pytest.mark.parametrize(
    ("name", "triangles", "low", "high"),
    [
        ("box.obj", 12, (-0.5, -0.5, -0.5), (0.5, 0.5, 0.5)),
        ("cube_usemtl.obj", 12, (0, 0, 0), (1, 1, 1)),
        ("CornellBox-Original.obj", 36, (-1.02, 0, -1.04), (1, 1.99, 0.99)),
        ("stanford-bunny.obj", 69451, (-0.09469, 0.032987, -0.061874), (0.061009, 0.187321, 0.0588)),
    ],
)
@pytest.mark.filterwarnings("ignore:.*ignored:UserWarning")
def test_real_files(name: str, triangles: int, low: tuple[float, ...], high: tuple[float, ...]) -> None:
    model = read_model(shared("mesh", name))
    assert sum(len(part.geometry.triangles) for part in model.mesh.parts) == triangles
    np.testing.assert_allclose(bounds(model.mesh), [low, high], atol=1e-6)
