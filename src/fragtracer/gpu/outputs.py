# SPDX-License-Identifier: MIT
"""What a program draws: textures, as colors of a framebuffer or as images (shaders/core/texels.glsl)."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from fragtracer.gpu.context import has_images


class Outputs:
    """Textures (width, height) of four float32 each, for the outputs 0, 1 and so on of a program."""

    def __init__(self, ctx: moderngl.Context, textures: Sequence[moderngl.Texture]) -> None:
        self._ctx, self._textures = ctx, tuple(textures)
        self._framebuffer = ctx.framebuffer(self._textures)
        self._has_images = has_images(ctx)
        self._masks(not self._has_images)  # a program that draws to images leaves colors undefined

    def use(self) -> None:
        """Draw here."""
        self._framebuffer.use()
        if self._has_images:
            for unit, texture in enumerate(self._textures):
                texture.bind_to_image(unit, read=False, write=True)

    def restrict(self, bottom: int, rows: int) -> None:
        """Limit drawing to ``rows`` rows from ``bottom`` (0 is the lowest) upwards."""
        self._framebuffer.scissor = (0, bottom, self._framebuffer.width, rows)

    def clear(self) -> None:
        """Set all texels to 0."""
        self.restrict(0, self._framebuffer.height)  # not the last band's, to which clearing would keep
        self._masks(True)
        self._framebuffer.clear()
        self._masks(not self._has_images)

    def read(self, output: int, bottom: int, rows: int) -> NDArray[np.float32]:
        """``rows`` rows of a texture from ``bottom`` upwards, (rows, width, 4), the lowest first."""
        width = self._framebuffer.width
        texels = self._framebuffer.read((0, bottom, width, rows), 4, attachment=output, dtype="f4")
        return np.frombuffer(texels, np.float32).reshape(rows, width, 4)

    def release(self) -> None:
        """Forget the framebuffer, not the textures."""
        self._ctx.detect_framebuffer(0).use()  # moderngl may bind again what was in use last
        self._framebuffer.release()

    def _masks(self, writes: bool) -> None:
        mask: Any = (writes,) * 4
        self._framebuffer.color_mask = mask if len(self._textures) == 1 else (mask,) * len(self._textures)


@contextmanager
def drawing_to(ctx: moderngl.Context, textures: Sequence[moderngl.Texture]) -> Iterator[Outputs]:
    """Outputs to ``textures``, in use; afterwards the framebuffer that was bound before is bound again."""
    before = ctx.detect_framebuffer()
    outputs = Outputs(ctx, textures)
    try:
        outputs.use()
        yield outputs
    finally:
        outputs.release()
        before.use()
