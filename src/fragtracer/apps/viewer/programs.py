# SPDX-License-Identifier: MIT
"""The programs that show a film, compiled when they are needed first."""

from collections.abc import Mapping
from typing import Any

from fragtracer.errors import ShaderError
from fragtracer.gpu.program import FullscreenProgram
from fragtracer.resources import folder

Items = tuple[tuple[str, int | str], ...]


class Programs:
    """Programs of ``context`` by file, defines and texture units; release them."""

    def __init__(self, context: Any) -> None:
        self._context = context
        self._programs: dict[tuple[str, Items, Items], FullscreenProgram] = {}

    def get(
        self, file: str, units: Mapping[str, int], defines: Mapping[str, int | str] | None = None
    ) -> FullscreenProgram:
        """The program of ``file``, below shaders/, with ``defines``, that has its samplers at ``units``.

        Raises
        ------
        ShaderError
            If it does not compile.
        """
        key = file, tuple(units.items()), tuple(sorted((defines or {}).items()))
        if key not in self._programs:
            self._programs[key] = self._compiled(*key)
        return self._programs[key]

    def reload(self) -> None:
        """Compile all of them again, as the shader files are now.

        Raises
        ------
        ShaderError
            If one does not compile. All of them stay as they were.
        """
        compiled: dict[tuple[str, Items, Items], FullscreenProgram] = {}
        try:
            for key in self._programs:
                compiled[key] = self._compiled(*key)
        except ShaderError:
            _release(compiled)
            raise
        self.release()
        self._programs = compiled

    def _compiled(self, file: str, units: Items, defines: Items) -> FullscreenProgram:
        program = FullscreenProgram(self._context, folder("shaders"), file, dict(defines))
        program.set(dict(units))
        return program

    def release(self) -> None:
        _release(self._programs)


def _release(programs: dict[tuple[str, Items, Items], FullscreenProgram]) -> None:
    for program in programs.values():
        program.release()
    programs.clear()
