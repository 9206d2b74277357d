# SPDX-License-Identifier: MIT
"""OpenGL contexts without a window, and what they can do."""

import ctypes
import os
import re
import sys
import weakref
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import moderngl

from fragtracer.cache import cache_folder
from fragtracer.errors import DeviceError

_VERSION = 330
_DEVICE = "GLCONTEXT_DEVICE_INDEX"  # read by glcontext, which prefers it to what it is asked for
_MOST_DEVICES = 16
_VECTOR_BITS = "LP_NATIVE_VECTOR_WIDTH"  # read by llvmpipe, before its first context
_MESA_CACHE = "MESA_SHADER_CACHE_DIR"
_MESA_OF_WIDE_VECTORS = 25  # from this version on, programs that draw to images compile with vectors of 512 bits
_MESA_THAT_SKIPS = 25  # branches; 22.3 executes them, and versions between were not tried
_MEND = {
    "linux": "install the Mesa libraries: 'apt install libegl1 libgl1 libgl1-mesa-dri' (Debian, Ubuntu) or "
    "'dnf install mesa-libEGL mesa-libGL mesa-dri-drivers' (Fedora)",
    "darwin": "macOS has OpenGL built in; run from a session that is logged in to the desktop",
}
_process: int | None = None  # that has used OpenGL


def use_wide_vectors() -> None:
    """Have llvmpipe calculate with vectors of 512 bits where the processor and Mesa have them, in place of 256.

    To be called before the first context of a process, and only where all that it draws are :class:`.Outputs`: a
    program with color outputs, as a window needs it, ends the process then. The environment variable
    ``LP_NATIVE_VECTOR_WIDTH`` is left as it is, if it is set.
    """
    if sys.platform == "linux" and _VECTOR_BITS not in os.environ and _has_wide_vectors():
        os.environ[_VECTOR_BITS] = "512"
        # Mesa takes the programs that it has kept for those of any width.
        kept = Path(os.environ.get(_MESA_CACHE) or cache_folder(), "mesa-512-bits")
        with suppress(OSError):
            kept.mkdir(parents=True, exist_ok=True)
        os.environ[_MESA_CACHE] = str(kept)


def _has_wide_vectors() -> bool:
    try:
        if not re.search(r"^flags\b.*\bavx512bw\b", Path("/proc/cpuinfo").read_text(), re.MULTILINE):
            return False
        ctypes.CDLL("libEGL_mesa.so.0")  # which needs the library that llvmpipe is in, whose name has Mesa's version
        versions = re.findall(r"/libgallium-(\d+)\.", Path("/proc/self/maps").read_text())
    except OSError:
        return False
    return bool(versions) and min(map(int, versions)) >= _MESA_OF_WIDE_VECTORS


def create_context() -> moderngl.Context:
    """A headless OpenGL 3.3 core context: a GPU's where there is one, else Mesa's software renderer.

    On Linux the devices of EGL are tried one after the other, and the first that works is taken; the
    environment variable ``GLCONTEXT_DEVICE_INDEX`` names one, counted from 0, in their place.

    Raises
    ------
    DeviceError
        If none can be made; the message says what to install. As :func:`check_process`.
    """
    check_process()
    reasons = []
    for options in _attempts():
        try:
            context = _checked(moderngl.create_context(require=_VERSION, standalone=True, **options))
            context.extra = options.get("backend")
            return context
        except DeviceError:
            raise
        except Exception as error:  # glcontext raises bare Exception for every way it can fail
            reasons.append(str(error))
    mend = _MEND.get(sys.platform, "install or update the graphics driver")
    if os.environ.get(_DEVICE):
        mend = f"{_DEVICE} is {os.environ[_DEVICE]!r}: unset it, or give the number of a device that works, from 0"
    raise DeviceError(f"no OpenGL 3.3 context could be made ({'; '.join(dict.fromkeys(reasons))}); {mend}")


def attach_context() -> moderngl.Context:
    """The OpenGL context that a window has made current.

    Raises
    ------
    DeviceError
        If it is older than OpenGL 3.3. As :func:`check_process`.
    """
    check_process()
    try:
        context = moderngl.create_context(require=_VERSION)
    except Exception as error:  # as above
        raise DeviceError(f"the window's OpenGL cannot be used: {error}") from None
    if _has_512_bits(context):
        raise DeviceError(f"llvmpipe cannot draw a window with vectors of 512 bits: unset {_VECTOR_BITS}")
    return context


def release_with(owner: object, ctx: moderngl.Context) -> None:
    """Release a context of :func:`create_context` once nothing refers to ``owner`` any more, in whatever thread that is
    found. Only with EGL: others take away the context that is current there."""
    if ctx.extra == "egl":
        weakref.finalize(owner, _release, ctx, os.getpid()).atexit = False


def _release(ctx: moderngl.Context, process: int) -> None:
    if os.getpid() == process:
        ctx.release()


def check_process() -> None:
    """Raise DeviceError in a process that was forked from one that has used OpenGL: its driver would wait for ever, for
    threads that were not forked."""
    global _process
    _process = _process or os.getpid()
    if _process != os.getpid():
        raise DeviceError(
            "this process was forked from one that has used OpenGL, which then works no more: start processes by "
            'multiprocessing.get_context("spawn"), or before anything is rendered'
        )


@contextmanager
def borrowed(ctx: moderngl.Context) -> Iterator[None]:
    """A context that others draw on, too: current, and in the state that the programs here need.

    It stays current. It gets back its framebuffer with viewport, scissor and masks, what ``enable`` has set,
    ``wireframe`` and ``point_size``; not what textures, images, samplers and programs are bound, ``blend_func`` and
    ``blend_equation``, which nobody can ask moderngl for, nor what was set by other libraries than moderngl.
    """
    ctx.mglo.__enter__()  # and not left: with EGL, none would be current then
    bound = ctx.detect_framebuffer()
    before = ctx.fbo if ctx.fbo is not None and ctx.fbo.glo == bound.glo else bound
    wireframe, point_size = ctx.wireframe, ctx.point_size
    screen = ctx.detect_framebuffer(0)
    screen.use()  # what the scope binds again, where the block releases the other one
    try:
        with ctx.scope(screen, moderngl.NOTHING):
            ctx.wireframe, ctx.point_size = False, 1.0
            ctx.clear_samplers()
            yield
    finally:
        ctx.wireframe, ctx.point_size = wireframe, point_size
        if not isinstance(before.mglo, moderngl.InvalidObject):
            before.use()


def _checked(context: moderngl.Context) -> moderngl.Context:
    """The context, unless its driver would end the process."""
    version = _mesa_version(context)
    if _has_512_bits(context) and version < _MESA_OF_WIDE_VECTORS:
        context.release()
        raise DeviceError(
            f"Mesa {version} fails with vectors of 512 bits: unset {_VECTOR_BITS}, or install Mesa "
            f"{_MESA_OF_WIDE_VECTORS} or later"
        )
    return context


def _has_512_bits(context: moderngl.Context) -> bool:
    return "512 bits" in context.info["GL_RENDERER"]


def _mesa_version(context: moderngl.Context) -> int:
    """The first number of Mesa's version; 0 if the driver is another one."""
    version = re.search(r"Mesa (\d+)", context.info["GL_VERSION"])
    return int(version[1]) if version else 0


def _attempts() -> list[dict[str, Any]]:
    if sys.platform != "linux":
        return [{}]
    named = {"backend": "egl", "libgl": "libGL.so.1", "libegl": "libEGL.so.1"}
    if os.environ.get(_DEVICE):
        return [named, {"backend": "egl"}]
    return [named | {"device_index": i} for i in range(_MOST_DEVICES)] + [{"backend": "egl"}, {}]


def describe(ctx: moderngl.Context) -> dict[str, str]:
    """Vendor, renderer, version and the limits that matter here, as text by name."""
    info = ctx.info
    return {
        "GL vendor": info["GL_VENDOR"],
        "GL renderer": info["GL_RENDERER"],
        "GL version": info["GL_VERSION"],
        "largest image": f"{max_size(ctx)} pixels a side",
        "uniform block": f"{info['GL_MAX_UNIFORM_BLOCK_SIZE'] // 1024} KiB",
        "texture units": str(info["GL_MAX_TEXTURE_IMAGE_UNITS"]),
        "software": "yes" if is_software(ctx) else "no",
    }


def max_size(ctx: moderngl.Context) -> int:
    """The longest side of an image that can be rendered, in pixels."""
    return int(min(ctx.info["GL_MAX_TEXTURE_SIZE"], *ctx.info["GL_MAX_VIEWPORT_DIMS"]))


def nearest_texture(
    ctx: moderngl.Context, size: tuple[int, int], components: int = 4, data: bytes | None = None, dtype: str = "f4"
) -> moderngl.Texture:
    """A texture of (width, height) texels that is read texel by texel."""
    texture = ctx.texture(size, components, data, dtype=dtype)
    texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
    return texture


def has_images(ctx: moderngl.Context) -> bool:
    """Whether programs read tables from images, and draw to images (shaders/core/texels.glsl)."""
    return ctx.version_code >= 420 and "llvmpipe" in ctx.info["GL_RENDERER"].lower()


def skips_branches(ctx: moderngl.Context) -> bool:
    """Whether the driver is known to skip a branch that none of its lanes takes, as llvmpipe does from Mesa 25 on.

    Before that it executes all branches, and throws away what they compute.
    """
    return has_images(ctx) and _mesa_version(ctx) >= _MESA_THAT_SKIPS


def is_software(ctx: moderngl.Context) -> bool:
    """Whether the CPU does the rendering."""
    renderer = ctx.info["GL_RENDERER"].lower()
    return any(name in renderer for name in ("llvmpipe", "softpipe", "swrast", "software"))
