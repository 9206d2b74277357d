# SPDX-License-Identifier: MIT
"""The graphics driver: devices that do not work, wide vectors, memory that runs out, and uploads."""

import os
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import moderngl
import numpy as np
import pytest

from fragtracer.errors import DeviceError
from fragtracer.gpu import context as contexts
from fragtracer.gpu import textures, tracer
from fragtracer.gpu.film import Film
from fragtracer.gpu.work import StageTextures, Tilings, work_texture
from fragtracer.io.toml import load
from fragtracer.packing import Table, pack
from fragtracer.renderer import Renderer
from fragtracer.sampling.allocation import Window
from fragtracer.scene import PLAIN


class Made:
    """A context, by the number of its device."""

    def __init__(self, index: int, renderer: str = "a GPU", version: str = "4.6") -> None:
        self.index, self.is_released = index, False
        self.info = {"GL_RENDERER": renderer, "GL_VERSION": version}
        self.version_code = 450

    def release(self) -> None:
        self.is_released = True


def devices(monkeypatch: pytest.MonkeyPatch, works: int | None, count: int = 3) -> list[int | None]:
    """Have a machine of ``count`` EGL devices of which one works; returns which are tried."""
    tried: list[int | None] = []

    def create(**options: Any) -> Made:
        index = options.get("device_index")
        tried.append(index)
        if index is None or index >= count:
            raise Exception(f"requested device index {index}, but found {count} devices")
        if index != works:
            raise Exception(f"eglInitialize failed on device {index}")
        return Made(index)

    monkeypatch.setattr(contexts.sys, "platform", "linux")
    monkeypatch.setattr(contexts.moderngl, "create_context", create)
    monkeypatch.delenv("GLCONTEXT_DEVICE_INDEX", raising=False)
    return tried


def test_a_device_that_does_not_work_is_passed_over(monkeypatch: pytest.MonkeyPatch) -> None:
    tried = devices(monkeypatch, works=2)
    assert contexts.create_context().index == 2
    assert tried == [0, 1, 2]


def test_where_no_device_works_the_reasons_are_given(monkeypatch: pytest.MonkeyPatch) -> None:
    devices(monkeypatch, works=None)
    with pytest.raises(DeviceError, match=r"failed on device 1; .*install"):
        contexts.create_context()


@pytest.mark.parametrize("name", ["99", "first"])
def test_a_device_that_was_asked_for_is_not_replaced(monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    """glcontext itself reads the variable."""
    monkeypatch.setattr(contexts.sys, "platform", "linux")
    monkeypatch.setenv("GLCONTEXT_DEVICE_INDEX", name)
    with pytest.raises(DeviceError, match=f"GLCONTEXT_DEVICE_INDEX is '{name}': unset it"):
        contexts.create_context()


@pytest.mark.parametrize(
    ("flags", "library", "expected"),
    [
        ("fpu avx512f avx512bw", "libgallium-25.0.7-2.so", "512"),
        ("fpu avx512f avx512bw", "libgallium-26.2.6-1.so", "512"),
        ("fpu avx512f avx512bw", "libgallium-24.2.8-1.so", None),
        ("fpu avx512f avx512bw", "swrast_dri.so", None),
        ("fpu avx2", "libgallium-25.0.7-2.so", None),
    ],
)
def test_vectors_are_wide_where_processor_and_mesa_have_them(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, flags: str, library: str, expected: str | None
) -> None:
    texts = {
        "/proc/cpuinfo": f"model name\t: x\nflags\t\t: {flags} clflush\n",
        "/proc/self/maps": f"7f r-xp /usr/lib/{library}\n",
    }
    monkeypatch.setattr(contexts.sys, "platform", "linux")
    monkeypatch.setattr(contexts.Path, "read_text", lambda path: texts[str(path)])
    monkeypatch.setattr(contexts.ctypes, "CDLL", lambda _: None)
    environment = {"MESA_SHADER_CACHE_DIR": str(tmp_path / "mesa")}
    monkeypatch.setattr(contexts.os, "environ", environment)
    contexts.use_wide_vectors()
    assert environment.get("LP_NATIVE_VECTOR_WIDTH") == expected
    kept = tmp_path / "mesa" / "mesa-512-bits"  # apart from programs of other widths
    assert kept.is_dir() == (expected is not None) == (environment["MESA_SHADER_CACHE_DIR"] == str(kept))
    environment["LP_NATIVE_VECTOR_WIDTH"] = "128"
    before = dict(environment)
    contexts.use_wide_vectors()
    assert environment == before


def test_without_mesa_nothing_is_asked_of_it(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(_: str) -> None:
        raise OSError("no such library")

    monkeypatch.setattr(contexts.sys, "platform", "linux")
    monkeypatch.setattr(contexts.ctypes, "CDLL", fail)
    environment: dict[str, str] = {}
    monkeypatch.setattr(contexts.os, "environ", environment)
    contexts.use_wide_vectors()
    assert environment == {}


@pytest.mark.parametrize("version", [22, 25])
def test_wide_vectors_are_refused_where_they_would_end_the_process(
    monkeypatch: pytest.MonkeyPatch, version: int
) -> None:
    made = Made(0, "llvmpipe (LLVM 15.0.6, 512 bits)", f"4.5 (Core Profile) Mesa {version}.0.7")
    monkeypatch.setattr(contexts.moderngl, "create_context", lambda **_: made)
    with pytest.raises(
        DeviceError, match="cannot draw a window with vectors of 512 bits: unset LP_NATIVE_VECTOR_WIDTH"
    ):
        contexts.attach_context()
    if version == 25:
        assert contexts.create_context() is made
    else:
        with pytest.raises(DeviceError, match="unset LP_NATIVE_VECTOR_WIDTH, or install Mesa 25 or later"):
            contexts.create_context()
        assert made.is_released


@pytest.mark.parametrize(
    ("renderer", "version", "expected"),
    [
        ("llvmpipe (LLVM 15.0.6, 256 bits)", "4.5 (Core Profile) Mesa 22.3.6", False),
        ("llvmpipe (LLVM 19.1.7, 256 bits)", "4.5 (Core Profile) Mesa 25.0.7-2", True),
        ("llvmpipe (LLVM 22.1.8, 512 bits)", "4.6 (Core Profile) Mesa 26.2.6-1", True),
        ("softpipe", "3.3 (Core Profile) Mesa 25.0.7-2", False),
        ("NVIDIA H100", "4.6.0 NVIDIA 570.124", False),
    ],
)
def test_new_versions_of_mesa_skip_branches(renderer: str, version: str, expected: bool) -> None:
    assert contexts.skips_branches(Made(0, renderer, version)) == expected


class Scarce:
    """A context whose memory ends after some textures, or before the second framebuffer."""

    def __init__(self, ctx: moderngl.Context, textures: int) -> None:
        self._ctx, self._left = ctx, textures
        self.living: list[Any] = []
        self.error_was_taken = False

    def __getattr__(self, name: str) -> Any:
        return getattr(self._ctx, name)

    @property
    def error(self) -> str:
        self.error_was_taken = True
        return str(self._ctx.error)

    def _made(self, resource: Any) -> Any:
        self.living.append(resource)
        return resource

    def texture(self, *arguments: Any, **options: Any) -> Any:
        if self._left == 0:
            raise moderngl.Error("cannot create texture")
        self._left -= 1
        return self._made(self._ctx.texture(*arguments, **options))

    def texture3d(self, *arguments: Any, **options: Any) -> Any:
        return self._made(self._ctx.texture3d(*arguments, **options))

    def program(self, **options: Any) -> Any:
        return self._made(self._ctx.program(**options))

    def framebuffer(self, *arguments: Any) -> Any:
        return self._made(self._ctx.framebuffer(*arguments))


@pytest.mark.parametrize("textures", range(6))
def test_a_film_that_does_not_fit_leaves_nothing_behind(ctx: moderngl.Context, textures: int) -> None:
    scarce: Any = Scarce(ctx, textures)
    with pytest.raises(DeviceError, match="no memory for an image of 8x4"):
        Film(scarce, 8, 4)
    assert len(scarce.living) == textures + textures // 3
    assert all(isinstance(resource.mglo, moderngl.mgl.InvalidObject) for resource in scarce.living)
    assert scarce.error_was_taken


@pytest.mark.parametrize("textures", range(11))
def test_stages_that_do_not_fit_leave_nothing_behind(ctx: moderngl.Context, textures: int) -> None:
    """The film of a list takes six textures, the pictures of the stages five."""
    scarce: Any = Scarce(ctx, textures)
    with pytest.raises(DeviceError, match="no memory for"):
        StageTextures(scarce, 4, Window(0, 0, 8, 4), 32, None)  # type: ignore[arg-type]
    assert all(isinstance(resource.mglo, moderngl.mgl.InvalidObject) for resource in scarce.living)
    assert scarce.error_was_taken


def test_lists_that_do_not_fit_leave_nothing_behind(ctx: moderngl.Context) -> None:
    scarce: Any = Scarce(ctx, 6)
    with pytest.raises(DeviceError, match="no memory for a list of 64 pixels"):
        Tilings(scarce, 8, 4)
    assert len(scarce.living) == 8
    assert all(isinstance(resource.mglo, moderngl.mgl.InvalidObject) for resource in scarce.living)
    with pytest.raises(DeviceError, match="no memory for a list of 32 pixels"):
        work_texture(scarce, 4, Window(0, 0, 8, 4))


@pytest.mark.parametrize("error", [DeviceError, MemoryError, moderngl.Error, KeyboardInterrupt])
def test_a_tracer_that_cannot_be_made_leaves_nothing_behind(
    ctx: moderngl.Context, monkeypatch: pytest.MonkeyPatch, error: type[BaseException]
) -> None:
    def fails(loading: textures.SceneTextures, tables: Mapping[str, Table]) -> None:
        load_tables(loading, tables)
        raise error

    load_tables = textures.SceneTextures.load
    monkeypatch.setattr(textures.SceneTextures, "load", fails)
    scene = load("furnace")
    packed, scarce = pack(scene, scene.render, 8, 4), Scarce(ctx, 16)
    with pytest.raises(error):
        tracer.Tracer(scarce, packed, tracer.TracerProgram())  # type: ignore[arg-type]
    kinds = {type(resource) for resource in scarce.living}
    assert kinds == {moderngl.Texture, moderngl.Texture3D, moderngl.Program}
    assert all(isinstance(resource.mglo, moderngl.mgl.InvalidObject) for resource in scarce.living)


@pytest.mark.parametrize("dtype", [np.float16, np.float32, np.uint32])
@pytest.mark.parametrize("count", [1, 4096, 2 * 4096, 5 * 4096 + 3])
def test_a_table_is_uploaded_whole(
    ctx: moderngl.Context, monkeypatch: pytest.MonkeyPatch, dtype: type[np.generic], count: int
) -> None:
    """In pieces of two rows, part by part, each from the beginning of a row."""
    monkeypatch.setattr(textures, "_WRITTEN", 2)
    parts = tuple(np.arange(4 * n, dtype=np.uint32).reshape(n, 4) % 2039 for n in (count, 7))
    table = tuple(part.astype(dtype) for part in parts)
    (texture,) = textures.folded_textures(ctx, {"u_scene": table}, ["u_scene"]).values()
    kind = {"f2": np.float16, "f4": np.float32, "u4": np.uint32}[texture.dtype]
    texels = np.frombuffer(texture.read(), kind).reshape(-1, 4)
    np.testing.assert_array_equal(texels[:count], parts[0])
    second = -(-count // 4096) * 4096
    np.testing.assert_array_equal(texels[second : second + 7], parts[1])
    texture.release()


def test_a_table_may_have_other_parts_of_as_many_rows(ctx: moderngl.Context) -> None:
    held = textures.SceneTextures(ctx)
    parts = [np.full((n, 4), n, np.uint32) for n in (2 * 4096, 4096, 7)]
    for table in (parts[:1], parts[1:], [parts[2], parts[1]]):
        held.load({"u_scene": tuple(table)})
        texels = np.frombuffer(held._textures["u_scene"].read(), np.uint32).reshape(-1, 4)
        for place, part in zip((0, 4096), table, strict=False):
            np.testing.assert_array_equal(texels[place : place + len(part)], part)
    held.release()


def test_a_table_is_whole_again_after_one_that_could_not_be_written(
    ctx: moderngl.Context, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also those of its parts that were the same as before."""
    held, write = textures.SceneTextures(ctx), textures._write_rows
    table, other = (tuple(np.full((7, 4), n, np.uint32) for n in some) for some in ((1, 2), (3, 4)))

    def fails(texture: moderngl.Texture, part: np.ndarray, row: int) -> None:
        if row:
            raise MemoryError
        write(texture, part, row)

    held.load({"u_scene": table})
    with monkeypatch.context() as patch:
        patch.setattr(textures, "_write_rows", fails)
        with pytest.raises(MemoryError):
            held.load({"u_scene": other})
    held.load({"u_scene": table})
    texels = np.frombuffer(held._textures["u_scene"].read(), np.uint32).reshape(-1, 4)
    for place, part in zip((0, 4096), table, strict=True):
        np.testing.assert_array_equal(texels[place : place + 7], part)
    held.release()


def test_pictures_on_a_gpu_take_another_camera_without_compiling(
    ctx: moderngl.Context, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whose driver takes seconds for a program."""
    compiled = []
    program = tracer.FullscreenProgram
    monkeypatch.setattr(tracer, "FullscreenProgram", lambda *a, **k: compiled.append(a[2]) or program(*a, **k))
    scene = load("cornell-box")
    moved = replace(scene, camera=replace(scene.camera, fov_degrees=20.0))
    images = {}
    for software in (True, False):
        monkeypatch.setattr(tracer, "is_software", lambda _, said=software: said)
        del compiled[:]
        with Renderer(scene, (16, 16), context=ctx, **PLAIN) as renderer:
            renderer.sample(4)
            renderer.reset(moved)
            renderer.sample(4)
            images[software] = renderer.image()
        assert len(compiled) == 1 + software
    np.testing.assert_allclose(*images.values(), rtol=1e-4, atol=1e-5)


OTHER_PATH = """
import sys
import numpy as np
from fragtracer.io.toml import load
from fragtracer.light_tracing import picture, sums, tracer
from fragtracer.renderer import Renderer
from fragtracer.scene import PLAIN

if sys.argv[2] == "softpipe":
    sums.is_software = lambda ctx: False
tracer._SIZE, tracer.PHOTONS, picture.PHOTONS = (64, 64), 4096, 4096  # softpipe is slow, and numbers no more vertices
images = {}
for name, choice, spp in (("knot", "", 8), ("grille", "adaptive", 48), ("glass", "light_tracing", 8)):
    settings = {**PLAIN, **({choice: "on"} if choice else {})}
    with Renderer(load(name), (12, 8), spp=spp, **settings) as renderer:
        images[name] = renderer.render()
        images["driver"] = renderer.driver
np.savez(sys.argv[1], **images)
"""


@pytest.mark.slow
def test_textures_in_place_of_images_give_the_same_picture(ctx: moderngl.Context, tmp_path: Path) -> None:
    """As GPUs have them: by softpipe, another driver of Mesa, with meshes, textures, stages and photons."""
    if not contexts.has_images(ctx):
        pytest.skip("this driver has no images: all tests are of textures")
    found = {}
    for name in ("llvmpipe", "softpipe"):
        path = tmp_path / f"{name}.npz"
        environment = {**os.environ, "GALLIUM_DRIVER": name, "FRAGTRACER_CACHE": str(tmp_path / name)}
        subprocess.run([sys.executable, "-c", OTHER_PATH, path, name], check=True, env=environment)
        with np.load(path) as images:
            found[name] = dict(images)
        assert str(found[name].pop("driver")).startswith(name)
    for name, image in found["llvmpipe"].items():
        differs = np.abs(found["softpipe"][name] - image) > 1e-3 * image.mean()
        assert differs.mean() < 0.02, name  # where a ray meets another triangle by rounding
        np.testing.assert_allclose(found["softpipe"][name].mean(), image.mean(), rtol=1e-3)
