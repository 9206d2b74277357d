# SPDX-License-Identifier: MIT
"""A fragment shader on the full-screen triangle."""

import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import moderngl

from fragtracer.errors import ShaderError
from fragtracer.shader_composer import compose

_UNIFORM = re.compile(r"\buniform\s+(?:highp\s+)?\w+\s+(\w+)")


class FullscreenProgram:
    """Compiles ``fragment`` (a path below ``root``) and draws it over the bound framebuffer.

    ``defines``, ``generated`` and ``optional`` are those of :func:`compose`; ``text_pass`` changes the text, line by
    line, before it goes to the driver.

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
    ) -> None:
        vertex = compose("fullscreen.vert", {}, root)
        source = compose(fragment, defines or {}, root, generated, optional=optional)
        text = source.text if text_pass is None else text_pass(source.text)
        try:
            self._program = ctx.program(vertex_shader=vertex.text, fragment_shader=text)
        except moderngl.Error as error:
            raise ShaderError(f"the driver rejects {fragment}:\n{source.translate(str(error)).strip()}") from None
        self._declared = frozenset(_UNIFORM.findall(source.text))
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

    @property
    def declared(self) -> frozenset[str]:
        """The names of all uniforms in the source."""
        return self._declared

    def draw(self) -> None:
        self._triangle.render(moderngl.TRIANGLES, vertices=3)

    def release(self) -> None:
        self._triangle.release()
        self._program.release()
