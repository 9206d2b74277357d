# SPDX-License-Identifier: MIT
"""The path tracing program with its scene, on a film: passes cut into bands of bounded duration."""

import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import moderngl
import numpy as np

from fragtracer.errors import DeviceError
from fragtracer.gpu.context import is_software, skips_branches
from fragtracer.gpu.cube_maps import MapSizes, brdf_map, environment_maps
from fragtracer.gpu.film import Film
from fragtracer.gpu.program import FullscreenProgram
from fragtracer.gpu.specialise import MOST_LISTED, Level, Specialisation, specialise
from fragtracer.gpu.textures import UNITS, MapTextures, SceneTextures
from fragtracer.gpu.timer import DrawTimer
from fragtracer.packing import PackedScene
from fragtracer.packing.environment import EnvironmentTables
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
_MAX_ROUNDS = 65000  # of all loops in a draw; llvmpipe of Mesa 22.3 stops a shader after 65,535
_MAPS = MapSizes()
# Said of what marks its pixel (`traversal_was_cut` of shaders/scene/shape.glsl).
CUT_SHORT = (
    "end before their time: the driver stops long loops, or they are in more than four dielectrics at once; render "
    "with fewer bounces, or let fewer dielectrics overlap"
)


@dataclass(frozen=True)
class TracerProgram:
    """Which program draws: ``name`` below ``root``, with ``defines`` in place of what a scene asks for, and how much of
    the scene is compiled into it, but for what is named in ``kept`` (:func:`.specialise`)."""

    name: str = "pathtracer.frag"
    defines: Mapping[str, int | str] = field(default_factory=dict)
    level: Level = Level.NOTHING
    kept: tuple[str, ...] = ()
    root: Path | None = None  # left out, the shaders of fragtracer


def picture_level(ctx: moderngl.Context, moves: bool = False) -> Level:
    """How much of a scene is compiled into the program of a picture: not the camera where it ``moves``, nor on GPUs,
    whose drivers take seconds for a program."""
    return Level.VIEW if is_software(ctx) and not moves else Level.SCENE


def most_outside_grid(ctx: moderngl.Context, level: Level) -> int:
    """How many shapes a scene may have before its spheres are in a grid.

    Any number, if nothing is compiled in: such a program serves all scenes, and has no grid.
    """
    if level is Level.NOTHING:
        return sys.maxsize
    return MOST_LISTED["default" if skips_branches(ctx) else "grid"]


class Tracer:
    """Holds ``packed`` on the GPU and draws passes of it with ``program``.

    Raises :class:`ShaderError` if the program does not compile, :class:`DeviceError` if the GPU cannot hold the scene.
    """

    def __init__(self, ctx: moderngl.Context, packed: PackedScene, program: TracerProgram) -> None:
        self._ctx = ctx
        self._is_software = is_software(ctx)
        self._random = upload_random_texture(ctx)
        self.timer = DrawTimer(ctx)  # of all bands so far
        self._pixel_samples_per_second = 0.0
        self._key: object = None
        self._program: FullscreenProgram | None = None
        self._kept: list[tuple[object, FullscreenProgram]] = []  # the last ones used, the newest first
        self._textures = SceneTextures(ctx)
        self._maps = MapTextures(ctx)
        self._mapped: EnvironmentTables | None = None  # the environment of the maps
        try:
            self.load(packed, program)
        except BaseException:
            self.release()
            raise

    def load(self, packed: PackedScene, program: TracerProgram, recompile: bool = False) -> None:
        """Take over another scene or program; compiles only if its features, or the values compiled into the program,
        are new, or if told to, because the shader files have changed.

        Raises :class:`ShaderError` if the program does not compile; the last one stays in use. Raises
        :class:`DeviceError` if the GPU cannot hold the scene, of which it may hold a part then.
        """
        specialisation = specialise(packed, program.level, program.kept, skips_branches(self._ctx))
        key = _key(packed, program, specialisation)
        if recompile or self._program is None or key != self._key:
            self._use_program(key, self._compiled(key, packed, program, specialisation, recompile))
            self._pixel_samples_per_second = 0.0
        self._textures.load(packed.tables)
        if packed.needs_maps:
            self._load_maps(packed.environment)
        self._max_rays = max(1, _MAX_ROUNDS // packed.path_rounds)
        features = packed.features
        flags = (packed.flags["u_has_panes"], packed.flags["u_has_sphere_grid"])
        may_go_on = 1 in (features["HAS_ALPHA"], features["HAS_MEDIA"], *flags)
        has_long_loops = packed.uniforms["u_bvh_root"] >= 0 or may_go_on
        self._is_limited = has_long_loops and self._is_software
        self.set(packed.all_uniforms)

    def knows(self, packed: PackedScene, program: TracerProgram) -> bool:
        """Whether :meth:`load` need not compile."""
        key = _key(packed, program, specialise(packed, program.level, program.kept))
        return any(known == key for known, _ in self._kept)

    def has_maps(self, packed: PackedScene) -> bool:
        """Whether :meth:`load` need not make the maps of an environment."""
        return not packed.needs_maps or (self._maps.gpu_bytes > 0 and packed.environment is self._mapped)

    def set(self, uniforms: Mapping[str, Any]) -> None:
        """Change uniforms alone, by name; those that the program does not have, or has compiled in, are passed over."""
        assert self._program is not None
        declared = self._program.declared
        self._program.set({name: value for name, value in uniforms.items() if name in declared})

    @property
    def pixel_samples_per_second(self) -> float:
        """The speed of the last draw by the clock of :attr:`timer`; 0 when the program is new."""
        return self._pixel_samples_per_second

    @property
    def max_rays(self) -> int:
        """Paths for each pixel that one draw is meant to finish."""
        return self._max_rays

    def bands(
        self, film: Film, rays: int, budget: float | None = None, work: moderngl.Texture | None = None
    ) -> Iterator[float]:
        """Draw one pass of ``rays`` paths for every pixel, a band of rows at a time, each meant to
        take ``budget`` seconds, or as long as goes well with the device.

        With ``work``, texel after texel of the film holds ``rays`` samples of a pixel that it names (film/work.glsl),
        up to its height.

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
            height = film.size[1] if work is None else work.height
            for rows in self._part(film, part, height, budget, work):
                if rows == 0:
                    self._max_rays = part // 2
                    break
                yield (done + part * rows / height) / rays
            else:
                film.swap(part)
                done += part
            if self._max_rays == 0:
                self._max_rays = 1
                raise DeviceError(f"paths {CUT_SHORT}")

    def _part(self, film: Film, rays: int, height: int, budget: float, work: moderngl.Texture | None) -> Iterator[int]:
        """Draw ``rays`` paths for every pixel; yields the rows drawn so far, or 0 when one path was cut short."""
        assert self._program is not None
        width = film.size[0]
        row = 0
        while row < height:
            self._bind(film)
            if work is not None:
                work.use(UNITS["u_work"])
            # Each time: other passes may be drawn in between.
            self.set({"u_rays": rays, "u_stage": film.stage, "u_has_work": int(work is not None)})
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
        self.set({"u_rays": 1, "u_stage": 0, "u_has_work": 0})
        self._bind(film)
        film.restrict(0, 1)
        self._program.draw()
        self._ctx.finish()

    @property
    def gpu_bytes(self) -> int:
        """Size of what is held on the GPU, without the program."""
        points = self._random.width * self._random.height * self._random.depth
        return 16 * points + self._textures.gpu_bytes + self._maps.gpu_bytes

    def _bind(self, film: Film) -> None:
        assert self._program is not None
        self._program.use("u_random_texture", self._random, UNITS["u_random_texture"])
        self._maps.use(self._program)
        self._textures.use(self._program)  # after the maps, one of which shares its unit
        film.bind(UNITS["u_film_mean"])

    def _rows(self, pixel_samples_per_row: int, budget: float) -> int:
        pixel_samples = max(_FIRST_BAND, self._pixel_samples_per_second * budget)
        rows = max(1, int(pixel_samples / pixel_samples_per_row))
        return rows if rows < _BLOCK_ROWS else rows - rows % _BLOCK_ROWS

    def _learn(self, pixel_samples: int, seconds: float) -> None:
        before = max(self._pixel_samples_per_second, _FIRST_BAND / DRAW_BUDGET)
        self._pixel_samples_per_second = min(pixel_samples / max(seconds, 1e-6), _MAX_GROWTH * before)

    def _compiled(
        self,
        key: object,
        packed: PackedScene,
        program: TracerProgram,
        specialisation: Specialisation,
        recompile: bool,
    ) -> FullscreenProgram:
        """The program, from those that are kept or new."""
        for known, kept in [] if recompile else self._kept:
            if known == key:
                return kept
        root = program.root or folder("shaders")
        compiled = FullscreenProgram(
            self._ctx,
            root,
            program.name,
            program.defines,
            text_pass=specialisation.apply,
            optional=packed.features,
        )
        if recompile:
            self._forget(0)
        self._kept.insert(0, (key, compiled))
        return compiled

    def _use_program(self, key: object, program: FullscreenProgram) -> None:
        self._kept.sort(key=lambda known: known[1] is not program)
        self._key, self._program = key, program
        self._forget(_MOST_KEPT)
        sizes = {
            "u_irradiance_size": _MAPS.irradiance,
            "u_prefiltered_size": _MAPS.prefiltered,
            "u_prefiltered_levels": _MAPS.levels,
        }
        self.set(UNITS | sizes)

    def _load_maps(self, tables: EnvironmentTables | None) -> None:
        """Take over the maps of another environment, in the unit of its tables, or of none."""
        if not self._maps.gpu_bytes:
            self._maps.put({"u_brdf_map": brdf_map(self._ctx, "KARIS_ENVIRONMENT", _MAPS)})
        elif tables is self._mapped:
            return
        black = np.zeros((1, 1, 3), np.float32)
        maps = {"irradiance": black, "prefiltered": black}
        if tables is not None:
            width, height = tables.size
            pixels = tables.texels[:, :3].astype(np.float32).reshape(height, width, 3)
            maps = environment_maps(self._ctx, pixels, _MAPS)
        self._maps.put({f"u_{name}_map": pixels for name, pixels in maps.items()})
        self._mapped = tables

    def _forget(self, most: int) -> None:
        for _, program in self._kept[most:]:
            program.release()
        del self._kept[most:]

    def release(self) -> None:
        self._forget(0)
        self._textures.release()
        self._maps.release()
        self._random.release()


def _key(packed: PackedScene, program: TracerProgram, specialisation: Specialisation) -> object:
    """What decides over the text of a program: scenes with equal values share one."""
    return program.root, program.name, dict(program.defines), dict(packed.features), specialisation.key


def upload_random_texture(ctx: moderngl.Context) -> moderngl.Texture3D:
    """The points of shaders/sampler/texture.glsl, on the GPU."""
    points = random_texture()
    layers, height, width, _ = points.shape
    texture = ctx.texture3d((width, height, layers), 4, points.tobytes(), dtype="f4")
    texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
    return texture
