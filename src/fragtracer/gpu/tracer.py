# SPDX-License-Identifier: MIT
"""The path tracing program with its scene, on a film: passes cut into bands of bounded duration."""

import time
from collections.abc import Iterator

import moderngl
import numpy as np

from fragtracer.gpu.film import Film
from fragtracer.gpu.program import FullscreenProgram
from fragtracer.packing import PackedScene
from fragtracer.random_texture import random_texture
from fragtracer.resources import folder

# No draw is meant to last longer: operating systems reset a GPU that is silent for about 2 s.
DRAW_BUDGET = 0.05  # seconds
_FIRST_BAND = 4096  # pixel samples
_MAX_GROWTH = 4.0  # of a band over the one before, while its cost is not known well
_BLOCK_BINDING = 0
_SCENE_UNIT, _RANDOM_UNIT, _FILM_UNIT = 0, 1, 2


class Tracer:
    """Holds ``packed`` on the GPU and draws passes of it.

    Raises :class:`ShaderError` if the program does not compile.
    """

    def __init__(self, ctx: moderngl.Context, packed: PackedScene) -> None:
        self._ctx = ctx
        self._random = _upload_random_texture(ctx)
        self._pixel_samples_per_second = 0.0
        self._source: object = None
        self._program: FullscreenProgram | None = None
        self._scene: moderngl.Buffer | moderngl.Texture | None = None
        self.load(packed)

    def load(self, packed: PackedScene) -> None:
        """Take over another scene; compiles only if its features, or the
        values baked into the program, differ from the last one's."""
        source = (packed.defines, packed.layout, packed.constants)
        if self._program is None or source != self._source:
            generated = {"generated/scene_layout.glsl": packed.layout}
            self._replace_program(
                FullscreenProgram(
                    self._ctx, folder("shaders"), "pathtracer.frag", packed.defines, generated, packed.constants
                )
            )
            self._source = source
            self._pixel_samples_per_second = 0.0
        self._upload_scene(packed)
        assert self._program is not None
        self._program.set(packed.uniforms)

    def bands(self, film: Film, rays: int) -> Iterator[int]:
        """Draw one pass of ``rays`` paths for every pixel, a band of rows at a time.

        Yields the number of rows drawn after each band, when its draw has finished. The film is
        swapped after the last; abandoned before that, it keeps what it had.
        """
        assert self._program is not None
        self._program.set({"u_rays": rays})
        width, height = film.size
        row = 0
        while row < height:
            self._bind(film)
            rows = min(self._rows(width * rays), height - row)
            film.restrict(row, rows)
            start = time.perf_counter()
            self._program.draw()
            self._ctx.finish()
            self._learn(width * rows * rays, time.perf_counter() - start)
            row += rows
            yield rows
        film.swap()

    def warm_up(self, film: Film) -> None:
        """Draw a row that is thrown away: a driver that compiles at the first draw does so now."""
        assert self._program is not None
        self._program.set({"u_rays": 1})
        self._bind(film)
        film.restrict(0, 1)
        self._program.draw()
        self._ctx.finish()

    def _bind(self, film: Film) -> None:
        assert self._scene is not None
        if isinstance(self._scene, moderngl.Buffer):
            self._scene.bind_to_uniform_block(_BLOCK_BINDING)
        else:
            self._scene.use(_SCENE_UNIT)
        self._random.use(_RANDOM_UNIT)
        film.bind(_FILM_UNIT)

    def _rows(self, pixel_samples_per_row: int) -> int:
        budget = max(_FIRST_BAND, self._pixel_samples_per_second * DRAW_BUDGET)
        return max(1, int(budget / pixel_samples_per_row))

    def _learn(self, pixel_samples: int, seconds: float) -> None:
        before = max(self._pixel_samples_per_second, _FIRST_BAND / DRAW_BUDGET)
        self._pixel_samples_per_second = min(pixel_samples / max(seconds, 1e-6), _MAX_GROWTH * before)

    def _replace_program(self, program: FullscreenProgram) -> None:
        if self._program is not None:
            self._program.release()
        self._program = program
        program.bind_block("SceneBlock", _BLOCK_BINDING)
        units = {"u_random_texture": _RANDOM_UNIT, "u_film_mean": _FILM_UNIT, "u_film_variance": _FILM_UNIT + 1}
        program.set({"u_scene": _SCENE_UNIT} | units)

    def _upload_scene(self, packed: PackedScene) -> None:
        if self._scene is not None:
            self._scene.release()
        if packed.defines["SCENE_IN_UNIFORMS"]:
            self._scene = self._ctx.buffer(packed.texels.tobytes())
            return
        rows = -(-len(packed.texels) // 4096)
        texels = np.zeros((rows * 4096, 4), np.float32)
        texels[: len(packed.texels)] = packed.texels
        self._scene = self._ctx.texture((4096, rows), 4, texels.tobytes(), dtype="f4")
        self._scene.filter = (moderngl.NEAREST, moderngl.NEAREST)

    def release(self) -> None:
        for resource in (self._program, self._scene, self._random):
            if resource is not None:
                resource.release()


def _upload_random_texture(ctx: moderngl.Context) -> moderngl.Texture3D:
    points = random_texture()
    layers, height, width, _ = points.shape
    texture = ctx.texture3d((width, height, layers), 4, points.tobytes(), dtype="f4")
    texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
    return texture
