# SPDX-License-Identifier: MIT
"""The path tracing program with its scene, on a film: passes cut into bands of bounded duration."""

from collections.abc import Iterator, Mapping
from typing import Any

import moderngl

from fragtracer.errors import DeviceError
from fragtracer.gpu.atlas import SAMPLERS, AtlasTextures
from fragtracer.gpu.context import is_software
from fragtracer.gpu.environment import EnvironmentTextures
from fragtracer.gpu.film import Film
from fragtracer.gpu.map_textures import MapTextures
from fragtracer.gpu.meshes import MeshTextures
from fragtracer.gpu.program import FullscreenProgram
from fragtracer.gpu.tables import folded_texture
from fragtracer.gpu.timer import DrawTimer
from fragtracer.packing import PackedScene
from fragtracer.packing.random_texture import random_texture
from fragtracer.resources import folder

# No draw is meant to last longer: operating systems reset a GPU that is silent for about 2 s.
DRAW_BUDGET = 0.05  # seconds
# Nothing resets a software renderer, and at the end of each draw all its threads wait for the last.
_SOFTWARE_DRAW_BUDGET = 0.25
_FIRST_BAND = 4096  # pixel samples
_BLOCK_ROWS = 4  # pixels are shaded in blocks (of four by four on llvmpipe); a band should not cut them
_MAX_GROWTH = 4.0  # of a band over the one before, while its cost is not known well
_MOST_KEPT = 3  # programs, so that going back to a kind of scene does not compile
_MAX_ROUNDS = 65000  # of all loops in a draw; llvmpipe stops a shader after 65,535
_BLOCK_BINDING = 0
_SCENE_UNIT, _RANDOM_UNIT, _FILM_UNIT = 0, 1, 2  # the film has two
_ENVIRONMENT_UNIT, _TREE_UNIT = 4, 5
_MESH_UNITS = {"u_mesh": 6, "u_mesh_vertices": 7, "u_mesh_lights": 8}
_ATLAS_UNIT = 9  # and 10
_MAPS_UNIT = 13  # and the two after it


class Tracer:
    """Holds ``packed`` on the GPU and draws passes of it.

    Raises :class:`ShaderError` if the program does not compile.
    """

    def __init__(self, ctx: moderngl.Context, packed: PackedScene) -> None:
        self._ctx = ctx
        self._is_software = is_software(ctx)
        self._random = _upload_random_texture(ctx)
        self.timer = DrawTimer(ctx)  # of all bands so far
        self._pixel_samples_per_second = 0.0
        self._source: object = None
        self._program: FullscreenProgram | None = None
        self._kept: list[tuple[object, FullscreenProgram]] = []  # the last ones used, the newest first
        self._scene: moderngl.Buffer | moderngl.Texture | None = None
        self._environment = EnvironmentTextures(ctx)
        self._meshes = MeshTextures(ctx)
        self._atlas = AtlasTextures(ctx)
        self._maps = MapTextures(ctx)
        self.load(packed)

    def load(self, packed: PackedScene, recompile: bool = False) -> None:
        """Take over another scene; compiles only if its features, or the values baked into the
        program, are new, or if told to, because the shader files have changed.

        Raises :class:`ShaderError` if the program does not compile; the last one stays in use.
        """
        if recompile or self._program is None or packed.program != self._source:
            self._use_program(self._compiled(packed, recompile))
            self._source = packed.program
            self._pixel_samples_per_second = 0.0
        self._upload_scene(packed)
        self._environment.load(packed.environment)
        self._meshes.load(packed.meshes)
        self._atlas.load(packed.atlas)
        if packed.defines["HAS_SPLIT_SUM_MAPS"]:
            self._maps.load(packed.environment)
        self._max_rays = max(1, _MAX_ROUNDS // packed.path_rounds)
        has_long_loops = packed.meshes is not None or packed.defines["HAS_ALPHA"] == 1
        self._is_limited = has_long_loops and self._is_software
        self.set(packed.uniforms)

    def knows(self, packed: PackedScene) -> bool:
        """Whether :meth:`load` need not compile a program for it."""
        return any(known == packed.program for known, _ in self._kept)

    def has_maps(self, packed: PackedScene) -> bool:
        """Whether :meth:`load` need not make the maps of an environment for it."""
        return not packed.defines["HAS_SPLIT_SUM_MAPS"] or self._maps.has(packed.environment)

    def set(self, uniforms: Mapping[str, Any]) -> None:
        """Change uniforms alone, by name: those of the camera, when nothing else has moved."""
        assert self._program is not None
        self._program.set(uniforms)

    @property
    def pixel_samples_per_second(self) -> float:
        """The speed of the last draw by the clock of :attr:`timer`; 0 when the program is new."""
        return self._pixel_samples_per_second

    @property
    def max_rays(self) -> int:
        """Paths for each pixel that one draw is meant to finish."""
        return self._max_rays

    def bands(self, film: Film, rays: int, budget: float | None = None) -> Iterator[float]:
        """Draw one pass of ``rays`` paths for every pixel, a band of rows at a time, each meant to
        take ``budget`` seconds, or as long as goes well with the device.

        Yields the share of the pass that is done after each band, when its draw has finished. The film is
        swapped after the last; abandoned before that, it keeps what it had. How long a ray's way through meshes
        is, nobody knows before: where a driver ends a draw's loops early, and a path with them, nothing of that draw
        is kept, and the pass goes on with fewer paths at a time, each time swapped.

        Raises :class:`DeviceError` if the driver does not even finish one path.
        """
        if budget is None:
            budget = _SOFTWARE_DRAW_BUDGET if self._is_software else DRAW_BUDGET
        done = 0
        while done < rays:
            part = min(rays - done, self._max_rays)
            for rows in self._part(film, part, budget):
                if rows == 0:
                    self._max_rays = part // 2
                    break
                yield (done + part * rows / film.size[1]) / rays
            else:
                film.swap(part)
                done += part
            if self._max_rays == 0:
                self._max_rays = 1
                raise DeviceError("the driver ends paths before their time; render with fewer bounces")

    def _part(self, film: Film, rays: int, budget: float) -> Iterator[int]:
        """Draw ``rays`` paths for every pixel; yields the rows drawn so far, or 0 when one path was cut short."""
        assert self._program is not None
        width, height = film.size
        row = 0
        while row < height:
            self._bind(film)
            self._program.set({"u_rays": rays})  # each time: other passes may be drawn in between
            rows = min(self._rows(width * rays, budget), height - row)
            film.restrict(row, rows)
            before = self.timer.seconds
            with self.timer:
                self._program.draw()
                self._ctx.finish()
            self._learn(width * rows * rays, self.timer.seconds - before)
            if self._is_limited and film.drawn_samples(row, rows) < film.samples + rays:
                yield 0
                return
            row += rows
            yield row

    def warm_up(self, film: Film) -> None:
        """Draw a row that is thrown away: a driver that compiles at the first draw does so now."""
        assert self._program is not None
        self._program.set({"u_rays": 1})
        self._bind(film)
        film.restrict(0, 1)
        self._program.draw()
        self._ctx.finish()

    @property
    def gpu_bytes(self) -> int:
        """Size of what is held on the GPU, without the program."""
        scene = self._scene
        assert scene is not None
        points = self._random.width * self._random.height * self._random.depth
        scene_bytes = scene.size if isinstance(scene, moderngl.Buffer) else 16 * scene.width * scene.height
        others = sum(held.gpu_bytes for held in (self._environment, self._meshes, self._atlas, self._maps))
        return 16 * points + scene_bytes + others

    def _bind(self, film: Film) -> None:
        assert self._scene is not None
        if isinstance(self._scene, moderngl.Buffer):
            self._scene.bind_to_uniform_block(_BLOCK_BINDING)
        else:
            self._scene.use(_SCENE_UNIT)
        self._random.use(_RANDOM_UNIT)
        self._environment.use(_ENVIRONMENT_UNIT, _TREE_UNIT)
        self._meshes.use(_MESH_UNITS)
        self._atlas.use(_ATLAS_UNIT)
        self._maps.use(_MAPS_UNIT)
        film.bind(_FILM_UNIT)

    def _rows(self, pixel_samples_per_row: int, budget: float) -> int:
        pixel_samples = max(_FIRST_BAND, self._pixel_samples_per_second * budget)
        rows = max(1, int(pixel_samples / pixel_samples_per_row))
        return rows if rows < _BLOCK_ROWS else rows - rows % _BLOCK_ROWS

    def _learn(self, pixel_samples: int, seconds: float) -> None:
        before = max(self._pixel_samples_per_second, _FIRST_BAND / DRAW_BUDGET)
        self._pixel_samples_per_second = min(pixel_samples / max(seconds, 1e-6), _MAX_GROWTH * before)

    def _compiled(self, packed: PackedScene, recompile: bool) -> FullscreenProgram:
        """The program for ``packed``, from those that are kept or new."""
        for known, program in [] if recompile else self._kept:
            if known == packed.program:
                return program
        generated = {"generated/scene_layout.glsl": packed.layout}
        program = FullscreenProgram(
            self._ctx, folder("shaders"), "pathtracer.frag", packed.defines, generated, packed.constants
        )
        if recompile:
            self._forget(0)
        self._kept.insert(0, (packed.program, program))
        return program

    def _use_program(self, program: FullscreenProgram) -> None:
        self._kept.sort(key=lambda known: known[1] is not program)
        self._program = program
        self._forget(_MOST_KEPT)
        program.bind_block("SceneBlock", _BLOCK_BINDING)
        units = {"u_random_texture": _RANDOM_UNIT, "u_film_mean": _FILM_UNIT, "u_film_variance": _FILM_UNIT + 1}
        units |= {"u_environment": _ENVIRONMENT_UNIT, "u_environment_tree": _TREE_UNIT}
        units |= {name: _ATLAS_UNIT + i for i, name in enumerate(SAMPLERS)}
        program.set({"u_scene": _SCENE_UNIT} | units | _MESH_UNITS | MapTextures.uniforms(_MAPS_UNIT))

    def _forget(self, most: int) -> None:
        for _, program in self._kept[most:]:
            program.release()
        del self._kept[most:]

    def _upload_scene(self, packed: PackedScene) -> None:
        if self._scene is not None:
            self._scene.release()
        if packed.defines["SCENE_IN_UNIFORMS"]:
            self._scene = self._ctx.buffer(packed.texels.tobytes())
            return
        self._scene = folded_texture(self._ctx, packed.texels)

    def release(self) -> None:
        self._forget(0)
        self._environment.release()
        self._meshes.release()
        self._atlas.release()
        self._maps.release()
        for resource in (self._scene, self._random):
            if resource is not None:
                resource.release()


def _upload_random_texture(ctx: moderngl.Context) -> moderngl.Texture3D:
    points = random_texture()
    layers, height, width, _ = points.shape
    texture = ctx.texture3d((width, height, layers), 4, points.tobytes(), dtype="f4")
    texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
    return texture
