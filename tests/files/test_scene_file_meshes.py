# SPDX-License-Identifier: MIT
"""Models on their own and in scene files: placed, materials replaced, saved with what they need beside them."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import PIL.Image
import pytest

import fragtracer as ft
from fragtracer.errors import OutputError, SceneError
from fragtracer.io.toml import dump, files_behind, load, save
from fragtracer.scene import Environment, Panorama
from fragtracer.scene.digest import scene_digests

from .data import Gltf

OBJ = "mtllib x.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nusemtl red\nf 1/1 2/2 3/3\n"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "models" / "other").mkdir(parents=True)
    PIL.Image.new("RGB", (2, 2), (255, 0, 0)).save(tmp_path / "models" / "red.png")
    (tmp_path / "models" / "x.mtl").write_text("newmtl red\nKd 1 0 0\nmap_Kd red.png\n")
    (tmp_path / "models" / "x.obj").write_text(OBJ)
    (tmp_path / "models" / "other" / "x.obj").write_text(OBJ.replace("mtllib x.mtl", "mtllib ../x.mtl"))
    return tmp_path


def scene(folder: Path, text: str) -> ft.Scene:
    (folder / "scene.toml").write_text(text)
    return load(folder / "scene.toml")


def test_mesh_tables(folder: Path) -> None:
    made = scene(
        folder,
        '[[mesh]]\nfile = "models/x.obj"\nscale = 2\nrotation_degrees = [0, 90, 0]\ntranslation = [1, 2, 3]\n'
        '[[mesh]]\nfile = "models/x.obj"\nname = "copies"\nmaterial = "gold"\n'
        "[[mesh.instance]]\ntranslation = [1, 0, 0]\n[[mesh.instance]]\nscale = [1, 2, -3]\n"
        '[[mesh]]\nfile = "models/other/x.obj"\n'
        '[material.gold]\nmetal = "gold"\n[material."x-2/red"]\nalbedo = 0.1\n',
    )
    first, second, third = made.meshes
    assert first.instances == (ft.Placement((1, 2, 3), (0, 90, 0), (2, 2, 2)),)
    assert second.instances == (ft.Placement((1, 0, 0)), ft.Placement(scale=(1, 2, -3)))
    assert (first.name, second.name, second.material, third.name) == ("x", "copies", "gold", "x")
    assert first.parts[0].geometry is second.parts[0].geometry
    assert (first.parts[0].material, third.parts[0].material) == ("x/red", "x-2/red")
    assert made.materials["x/red"].albedo == (1, 0, 0)
    assert made.materials["x-2/red"] == ft.Material(albedo=(0.1, 0.1, 0.1))
    (folder / "away").mkdir()
    save(made, folder / "away" / "scene.toml")
    assert load(folder / "away" / "scene.toml") == made
    text = (folder / "away" / "scene.toml").read_text()
    assert 'file = "../models/x.obj"' in text
    assert 'material."x/red"' not in text
    assert files_behind(made) == {folder / "models" / name for name in ("x.obj", "x.mtl", "red.png")} | {
        folder / "models" / "other" / "x.obj",
        folder / "models" / "other" / ".." / "x.mtl",
    }


def write_rising(folder: Path) -> None:
    gltf = Gltf()
    gltf.triangle()
    gltf.animation("rise", (0, "translation", [0, 2], [[0, 0, 0], [0, 4, 0]], "LINEAR"))
    gltf.write(folder / "x.glb")


def test_meshes_in_a_pose(tmp_path: Path) -> None:
    """Of an animation by name or number; a saved scene has it again."""
    write_rising(tmp_path)
    made = scene(
        tmp_path,
        '[[mesh]]\nfile = "x.glb"\nanimation = "rise"\ntime = 0.5\n'
        '[[mesh]]\nfile = "x.glb"\nanimation = 0\ntime = 9\nname = "high"\n'
        '[[mesh]]\nfile = "x.glb"\nanimation = "rise"\n',
    )
    assert [mesh.pose for mesh in made.meshes] == [ft.Pose("rise", 0.5), ft.Pose("0", 9), ft.Pose("rise")]
    assert [mesh.parts[0].matrix[1][3] for mesh in made.meshes] == [1, 4, 0]
    assert len({mesh.parts[0].geometry for mesh in made.meshes}) == 1
    ended = replace(made, meshes=tuple(replace(mesh, pose=ft.Pose("rise", 2)) for mesh in made.meshes))
    assert scene_digests(ended) == scene_digests(made)  # of the picture
    (tmp_path / "away").mkdir()
    save(made, tmp_path / "away" / "scene.toml")
    assert load(tmp_path / "away" / "scene.toml") == made
    moved = replace(made.meshes[0], parts=made.meshes[1].parts)
    save(replace(made, meshes=(moved,)), tmp_path / "away" / "moved.toml")  # what is in no file is written beside
    (again,) = load(tmp_path / "away" / "moved.toml").meshes
    assert (again.parts, again.pose) == (moved.parts, None)


@pytest.mark.filterwarnings("ignore:.*ignored. animations:UserWarning")
@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ('animation = "fall"', r"mesh\[0\].animation: .*x.glb: there is no animation 'fall'; choose from rise$"),
        ("animation = 1", r"mesh\[0\].animation: .*x.glb: there is no animation '1'; choose from rise$"),
        ("animation = true", r"mesh\[0\].animation: must be a name in quotes or a number, from 0 on, got true$"),
        ("time = 3", r"mesh\[0\].animation: is missing; give a name in quotes or a number, from 0 on$"),
        ('animation = "rise"\ntime = "late"', r'mesh\[0\].time: must be a number, got "late"$'),
        ('animation = "rise"\ntime = inf', r"mesh\[0\].time: must be a finite number, got inf$"),
    ],
)
def test_mistakes_of_poses(tmp_path: Path, keys: str, message: str) -> None:
    write_rising(tmp_path)
    with pytest.raises(SceneError, match=message) as caught:
        scene(tmp_path, f'[[mesh]]\nfile = "x.glb"\n{keys}\n')
    assert len(str(caught.value).splitlines()) == 1


def test_a_material_that_replaces_none(folder: Path) -> None:
    text = '[[mesh]]\nfile = "models/x.obj"\n[material."x/rde"]\n[material."y/rde"]\n'
    message = r'scene\.toml: material\."x/rde": ignored: the model "x" has no such material; did you mean x/red\?'
    with pytest.warns(UserWarning, match=message) as found:
        scene(folder, text)
    assert len(found) == 1
    scene(folder, text + '[[sphere]]\ncenter = [0, 0, 0]\nradius = 1\nmaterial = "x/rde"\n')


def test_an_edited_material_of_a_model_is_saved(folder: Path) -> None:
    made = scene(folder, '[[mesh]]\nfile = "models/x.obj"\n')
    edited = replace(made, materials={"x/red": replace(made.materials["x/red"], roughness=0.1)})
    save(edited, folder / "scene.toml")
    assert load(folder / "scene.toml") == edited
    assert 'albedo_texture = "models/red.png"' in (folder / "scene.toml").read_text()


def test_meshes_and_images_made_in_python_are_written_beside(tmp_path: Path) -> None:
    rng = np.random.default_rng(5)
    geometry = ft.Geometry(
        rng.random((4, 3)),
        [[0, 1, 2], [0, 2, 3]],
        normals=rng.random((4, 3)),
        uvs=rng.random((4, 2)),
        uvs_1=rng.random((4, 2)),
        tangents=rng.random((4, 4)),
        colors=rng.random((4, 4)),
    )
    moved = ((1.0, 0.0, 0.0, 2.5), (0.0, 0.0, 1.0, 0.0), (0.0, -1.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))
    parts = (ft.Part(geometry, "a"), ft.Part(ft.Geometry(rng.random((3, 3)), [[0, 1, 2]]), "b/c", moved))
    mesh = ft.Mesh(parts=parts, instances=(ft.Placement((1, 2, 3)), ft.Placement()), name="a knot?")
    maps = [rng.integers(0, 255, (3, 2, c)).astype(np.uint8) for c in (1, 2, 3, 4)]
    floats = [rng.random((3, 2, c)).astype(np.float32) for c in (3, 4)]
    textures = [ft.Texture(ft.Image(pixels, "linear")) for pixels in (*maps, *floats)]
    names = ("roughness", "metallic", "normal", "albedo", "emission", "occlusion")
    material = ft.Material(**{f"{name}_texture": texture for name, texture in zip(names, textures, strict=True)})
    made = ft.Scene(meshes=(mesh,), materials={"a": material, "b/c": ft.Material(), "unused": ft.Material(albedo=0)})
    with pytest.raises(OutputError, match=r"a knot\? is in no file; fragtracer.save writes one beside the scene"):
        dump(made)
    save(made, tmp_path / "s.toml")
    files = sorted(path.name for path in tmp_path.iterdir())
    assert [name.rpartition("-")[0] for name in files[:-1]] == sorted(["s-a-knot", *(f"s-{name}" for name in names)])
    again = load(tmp_path / "s.toml")
    assert replace(again, name=made.name, meshes=()) == replace(made, meshes=())
    assert replace(again.meshes[0], file=None) == mesh
    times = {path: path.stat().st_mtime_ns for path in tmp_path.iterdir() if path.suffix != ".toml"}
    save(made, tmp_path / "s.toml")
    save(again, tmp_path / "s.toml")
    assert times == {path: path.stat().st_mtime_ns for path in tmp_path.iterdir() if path.suffix != ".toml"}


def test_an_environment_made_in_python_is_written_beside(tmp_path: Path) -> None:
    pixels = np.random.default_rng(6).random((4, 8, 3)).astype(np.float32)
    made = ft.Scene(environment=Environment(image=Panorama(pixels), strength=2.0))
    save(made, tmp_path / "s.toml")
    again = load(tmp_path / "s.toml").environment
    assert again == made.environment
    assert again is not None
    assert again.image is not None
    assert again.image.file is not None
    assert Path(again.image.file).parent == tmp_path


def test_a_mesh_that_is_not_as_in_its_file_is_written(folder: Path) -> None:
    mesh, materials = ft.load_mesh(folder / "models" / "x.obj")
    doubled = replace(mesh, parts=mesh.parts * 2)
    save(ft.Scene(meshes=(doubled,), materials=materials), folder / "s.toml")
    again = load(folder / "s.toml").meshes[0]
    assert again.parts == doubled.parts
    assert again.file is not None
    assert again.file.endswith(".npz")


NOTHING = ft.Geometry(np.zeros((0, 3)), np.zeros((0, 3), int))


@pytest.mark.parametrize("empty", [ft.Mesh(()), ft.Mesh((ft.Part(NOTHING, "m"),))])
def test_meshes_without_triangles_are_not_saved(tmp_path: Path, empty: ft.Mesh) -> None:
    triangle = ft.Part(ft.Geometry([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)]), "m")
    mesh = ft.Mesh((ft.Part(NOTHING, "m"), triangle), name="kept")
    save(ft.Scene(meshes=(empty, mesh), materials={"m": ft.Material()}), tmp_path / "s.toml")
    [again] = load(tmp_path / "s.toml").meshes
    assert replace(again, file=None) == mesh
    assert len(list(tmp_path.glob("*.npz"))) == 1
    assert "mesh" not in dump(ft.Scene(meshes=(empty,), materials={"m": ft.Material()}))


def test_a_mesh_without_an_area_is_saved(tmp_path: Path) -> None:
    flat = ft.Mesh((ft.Part(ft.Geometry([(0, 0, 0)] * 3, [(0, 1, 2)]), "m"),), name="flat")
    save(ft.Scene(meshes=(flat,), materials={"m": ft.Material()}), tmp_path / "s.toml")
    assert [replace(mesh, file=None) for mesh in load(tmp_path / "s.toml").meshes] == [flat]


def test_a_mesh_without_instances_stays_without_them(folder: Path) -> None:
    mesh, materials = ft.load_mesh(folder / "models" / "x.obj")
    hidden = ft.Scene(meshes=(replace(mesh, instances=()),), materials=materials, name="s")
    save(hidden, folder / "s.toml")
    assert load(folder / "s.toml") == hidden


@pytest.mark.parametrize("scale", [1e-6, 1, 1e6])
def test_bare_models_are_framed_and_lit(tmp_path: Path, scale: float) -> None:
    corners = [f"v {scale * (5 + x)} {scale * 2 * y} {scale * z}" for x in (0, 1) for y in (0, 1) for z in (0, 1)]
    (tmp_path / "x.obj").write_text("\n".join([*corners, "f 1 2 4 3", "f 5 7 8 6"]))
    made = load(tmp_path / "x.obj")
    assert (made.name, list(made.materials)) == ("x", ["x/default"])
    [light] = made.lights
    center = scale * np.array([5.5, 1, 0.5])
    np.testing.assert_allclose(made.camera.target, center)
    points = scale * np.array([(5 + x, 2 * y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)])
    forward = np.subtract(made.camera.target, made.camera.position)
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, made.camera.up)
    right /= np.linalg.norm(right)
    offset = points - made.camera.position
    depth = offset @ forward
    high = np.abs(offset @ np.cross(right, forward)) / depth / np.tan(np.radians(made.camera.fov_degrees) / 2)
    wide = np.abs(offset @ right) / depth / np.tan(np.radians(made.camera.fov_degrees) / 2) / (4 / 3)
    assert 0.8 < max(high.max(), wide.max()) < 1
    irradiance = np.divide(light.intensity, np.sum(np.subtract(light.position, center) ** 2))
    np.testing.assert_allclose(irradiance, 2.4)
    assert np.max(made.ambient.radiance) == 0.3
    save(made, tmp_path / "x.toml")
    assert load(tmp_path / "x.toml") == made


def test_a_model_for_an_environment_gets_no_lights(tmp_path: Path) -> None:
    (tmp_path / "x.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    made = load(tmp_path / "x.obj", light_models=False)
    assert not made.lights
    assert not any(made.ambient.radiance)


def test_an_emissive_model_gets_no_lights(tmp_path: Path) -> None:
    (tmp_path / "x.mtl").write_text("newmtl lamp\nKe 1 1 1\n")
    (tmp_path / "x.obj").write_text("mtllib x.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl lamp\nf 1 2 3\n")
    made = load(tmp_path / "x.obj")
    assert not made.lights
    assert not any(made.ambient.radiance)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("mesh = 3", "mesh: must be an array of tables, each opened by [[mesh]], got 3"),
        ("mesh = [3]", "mesh[0]: must be a table, with a line for each of its keys, got 3"),
        ("[[mesh]]", "mesh[0].file: is missing; name a model"),
        ("[[mesh]]\nfile = 3", "mesh[0].file: must be a text in quotes, got 3"),
        ('[[mesh]]\nfile = "none.obj"', "none.obj: no such file"),
        ('[[mesh]]\nfile = "scene.toml"', "cannot read this kind of model; choose from .obj, .ply"),
        (
            '[[mesh]]\nfile = "models/x.obj"\nmaterial = "rod"',
            'mesh[0].material: there is no material "rod"; choose from',
        ),
        ('[[mesh]]\nfile = "models/x.obj"\nmaterial = 3', "mesh[0].material: must be a text in quotes, got 3"),
        ('[[mesh]]\nfile = "models/x.obj"\nscale = 0', "mesh[0].scale: must not be 0 along any axis, got 0"),
        ('[[mesh]]\nfile = "models/x.obj"\nscale = "a"', "mesh[0].scale: must be a number or three numbers [x, y, z]"),
        (
            '[[mesh]]\nfile = "models/x.obj"\nrotation = 3',
            "mesh[0].rotation: there is no such key; did you mean rotation_",
        ),
        (
            '[[mesh]]\nfile = "models/x.obj"\nscale = 1\n[[mesh.instance]]',
            "mesh[0]: move scale into the [[mesh.instance]] tables, one for each instance",
        ),
        (
            '[[mesh]]\nfile = "models/x.obj"\nscale = 1\ninstance = []',
            "mesh[0]: move scale into the [[mesh.instance]] tables, one for each instance",
        ),
        (
            '[[mesh]]\nfile = "models/x.obj"\n[[mesh.instance]]\ntranslation = 3',
            "mesh[0].instance[0].translation: must be three numbers [x, y, z], got 3",
        ),
        ('[[mesh]]\nfile = "models/x.obj"\ninstance = 3', "mesh[0].instance: must be an array of tables"),
    ],
)
def test_mistakes_are_named(folder: Path, text: str, message: str) -> None:
    with pytest.raises(SceneError) as raised:
        scene(folder, text)
    assert message in str(raised.value)
    assert str(raised.value).startswith(f"{folder / 'scene.toml'}: mesh")
    assert "\n" not in str(raised.value)
