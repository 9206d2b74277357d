# SPDX-License-Identifier: MIT
"""A fragment shader on the full-screen triangle."""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import moderngl

from fragtracer.errors import ShaderError
from fragtracer.shader_composer import compose

_UNIFORM = re.compile(r"\buniform\s+(?:highp\s+)?\w+\s+(\w+)")


class FullscreenProgram:
    """Compiles ``fragment`` (a path below ``root``) and draws it over the bound framebuffer.

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
        defines: Mapping[str, int] | None = None,
        generated: Mapping[str, str] | None = None,
        constants: Mapping[str, Any] | None = None,
    ) -> None:
        vertex = compose("fullscreen.vert", {}, root)
        source = compose(fragment, defines or {}, root, generated, constants)
        try:
            self._program = ctx.program(vertex_shader=vertex.text, fragment_shader=source.text)
        except moderngl.Error as error:
            raise ShaderError(f"the driver rejects {fragment}:\n{source.translate(str(error)).strip()}") from None
        self._declared = set(_UNIFORM.findall(source.text))
        self._triangle = ctx.vertex_array(self._program, [])

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
            member = self._program.get(name, None)
            if isinstance(member, moderngl.Uniform):
                member.value = value

    def bind_block(self, name: str, binding: int) -> None:
        """Connect a uniform block, if the program uses it, to a buffer binding point."""
        block = self._program.get(name, None)
        if isinstance(block, moderngl.UniformBlock):
            block.binding = binding

    def draw(self) -> None:
        self._triangle.render(moderngl.TRIANGLES, vertices=3)

    def release(self) -> None:
        self._triangle.release()
        self._program.release()
