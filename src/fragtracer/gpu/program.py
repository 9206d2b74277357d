# SPDX-License-Identifier: MIT
"""A fragment shader on the full-screen triangle, or on points."""

import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import moderngl

from fragtracer.errors import ShaderError
from fragtracer.gpu.context import has_images
from fragtracer.gpu.reachable import reachable
from fragtracer.interruption import deferred
from fragtracer.shader_composer import compose

_UNIFORM = re.compile(r"^uniform\s+(?:highp\s+)?\w+\s+(\w+)", re.MULTILINE)
_TABLE = re.compile(r"^U?TEXELS(?:_3D)?\((\d+)\)\s+(\w+)", re.MULTILINE)  # of shaders/core/texels.glsl


class _Program:
    """Compiles ``fragment`` and ``vertex`` (paths below ``root``); vertices have no attributes but their numbers.

    ``defines``, ``generated`` and ``optional`` are those of :func:`compose`; ``text_pass`` changes the text of the
    fragment shader, line by line, before it goes to the driver.

    Raises
    ------
    ShaderError
        If the driver rejects the source; its messages carry ``file:line`` of the shader files.
    """

    def __init__(
        self,
        ctx: moderngl.Context,
        root: Path,
        fragment: str,
        defines: Mapping[str, int | str] | None = None,
        generated: Mapping[str, str] | None = None,
        text_pass: Callable[[str], str] | None = None,
        optional: Mapping[str, int | str] | None = None,
        vertex: str = "fullscreen.vert",
    ) -> None:
        vertices = compose(vertex, {}, root, generated)
        self._ctx, self._has_images = ctx, has_images(ctx)
        language = "330 core, images" if self._has_images else "330 core"
        source = compose(fragment, defines or {}, root, generated, language, optional)
        text = reachable(source.text if text_pass is None else text_pass(source.text))
        try:
            with deferred():
                self._program = ctx.program(vertex_shader=vertices.text, fragment_shader=text)
        except moderngl.Error as error:
            log = str(error)
            is_of_vertices = "\nvertex_shader\n" in log  # as moderngl says
            name, rejected = (vertex, vertices) if is_of_vertices else (fragment, source)
            raise ShaderError(f"the driver rejects {name}:\n{rejected.translate(log).strip()}") from None
        self._tables = {name: int(unit) for unit, name in _TABLE.findall(source.text)}
        self._declared = frozenset(_UNIFORM.findall(vertices.text + source.text)) | self._tables.keys()
        self._vertices = ctx.vertex_array(self._program, [])

    def set(self, uniforms: Mapping[str, Any]) -> None:
        """Set uniforms by name; those that the compiler found unused are passed over.

        Raises
        ------
        ShaderError
            If the source declares no such uniform.
        """
        for name, value in uniforms.items():
            if name not in self._declared:
                raise ShaderError(f"the shader has no uniform {name}")
            if self._has_images and name in self._tables:
                continue  # its unit is in the source
            member = self._program.get(name, None)
            if isinstance(member, moderngl.Uniform):
                member.value = value

    @property
    def declared(self) -> frozenset[str]:
        """The names of all uniforms in the source."""
        return self._declared

    def use(self, name: str, texture: moderngl.Texture | moderngl.TextureArray | moderngl.Texture3D, unit: int) -> None:
        """Read ``texture`` by its ``name`` in the source: from the texture unit of that name, or as an image."""
        if self._has_images and name in self._tables:
            texture.bind_to_image(self._tables[name], read=True, write=False)
        else:
            texture.use(unit)

    def _draw(self, mode: int, count: int) -> None:
        self._vertices.render(mode, vertices=count)
        if self._has_images:
            self._ctx.memory_barrier()

    def release(self) -> None:
        self._vertices.release()
        self._program.release()


class FullscreenProgram(_Program):
    """Draws a fragment shader over the bound framebuffer."""

    def draw(self) -> None:
        self._draw(moderngl.TRIANGLES, 3)


class PointsProgram(_Program):
    """Draws points of a pixel each, where its vertex shader has them."""

    def add(self, count: int) -> None:
        """Draw ``count`` points, and add their colors to those of the bound framebuffer, one after the other."""
        self._ctx.enable(moderngl.BLEND)
        self._ctx.blend_func = moderngl.ONE, moderngl.ONE
        self._ctx.blend_equation = moderngl.FUNC_ADD, moderngl.FUNC_ADD
        try:
            self._draw(moderngl.POINTS, count)
        finally:
            self._ctx.disable(moderngl.BLEND)
            self._ctx.blend_func = moderngl.SRC_ALPHA, moderngl.ONE_MINUS_SRC_ALPHA  # moderngl's own
