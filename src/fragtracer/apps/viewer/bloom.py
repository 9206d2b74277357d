# SPDX-License-Identifier: MIT
"""The glare of what the window shows, through shaders/display/bloom.frag; display/bloom.py defines it."""

from collections.abc import Mapping
from typing import Any

from fragtracer.apps.viewer.programs import Programs
from fragtracer.display.bloom import BLOCK, TAPS, weights

Size = tuple[int, int]
_LEVEL, _COARSE = 5, 6  # texture units beside those of the picture
_UNITS = {"u_film_mean": 0, "u_held": 2, "u_other": 3, "u_level": _LEVEL, "u_coarse": _COARSE}


class Bloom:
    """Textures at 1/4, 1/8 and 1/16 of a picture, filled by ``programs``."""

    def __init__(self, context: Any, programs: Programs) -> None:
        self._context, self._programs = context, programs
        self._size: Size | None = None
        self._levels: list[tuple[Any, Any]] = []  # two at each resolution, each with its framebuffer

    def draw(self, size: Size, shown: Mapping[str, int], uniforms: Mapping[str, Any], threshold: float) -> None:
        """Compute the glare of a picture of ``size`` pixels.

        ``shown`` and ``uniforms`` are the defines and uniforms of display/picture.glsl and u_exposure, whose
        textures are bound.
        """
        self._resize(size)
        quarter, quarter_b, eighth, eighth_b, sixteenth, sixteenth_b = range(6)
        common = dict(uniforms) | {"u_size": size, "u_threshold": threshold}
        self._pass(quarter, "BRIGHT", shown, common)
        self._pass(eighth, "HALF", level=quarter)
        self._pass(sixteenth, "HALF", level=eighth)
        self._blur(sixteenth, sixteenth_b, TAPS[0])
        self._pass(eighth_b, "ADD", level=eighth, coarse=sixteenth)
        self._blur(eighth_b, eighth, TAPS[1])
        self._pass(quarter_b, "ADD", level=quarter, coarse=eighth_b)
        self._blur(quarter_b, quarter, TAPS[2], 1 / 3)

    @property
    def result(self) -> Any:
        """The texture at 1/4, row 0 at the bottom, that :meth:`draw` has left."""
        return self._levels[1][0]

    def covered(self, size: Size) -> tuple[float, float]:
        """How many texels of :attr:`result` a picture of ``size`` pixels covers."""
        return size[0] / 4, size[1] / 4

    def _blur(self, level: int, other: int, taps: int, factor: float = 1.0) -> None:
        """Blur ``level``, by way of ``other``."""
        uniforms = {"u_weights": tuple(weights(taps))}
        radius = {"BLOOM_RADIUS": taps // 2}
        self._pass(other, "BLUR_X", radius, uniforms | {"u_factor": 1.0}, level)
        self._pass(level, "BLUR_Y", radius, uniforms | {"u_factor": factor}, other)

    def _pass(
        self,
        target: int,
        kind: str,
        defines: Mapping[str, int] | None = None,
        uniforms: Mapping[str, Any] | None = None,
        level: int | None = None,
        coarse: int | None = None,
    ) -> None:
        program = self._programs.get("display/bloom.frag", _UNITS, {"BLOOM_PASS": f"BLOOM_{kind}", **(defines or {})})
        program.set(uniforms or {})
        for unit, source in ((_LEVEL, level), (_COARSE, coarse)):
            if source is not None:
                self._levels[source][0].use(unit)
        texture, framebuffer = self._levels[target]
        framebuffer.use()
        framebuffer.viewport = framebuffer.scissor = (0, 0, *texture.size)
        program.draw()

    def _resize(self, size: Size) -> None:
        if size == self._size:
            return
        self.release()
        self._size = size
        blocks = [-(-side // BLOCK) for side in size]
        for scale in (4, 4, 2, 2, 1, 1):
            texture = self._context.texture((blocks[0] * scale, blocks[1] * scale), 4, dtype="f4")
            self._levels.append((texture, self._context.framebuffer([texture])))

    def release(self) -> None:
        if self._levels:
            self._context.detect_framebuffer(0).use()  # moderngl would bind the released one again
        for texture, framebuffer in self._levels:
            framebuffer.release()
            texture.release()
        self._levels = []
