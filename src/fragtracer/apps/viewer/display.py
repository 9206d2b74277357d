# SPDX-License-Identifier: MIT
"""Shows a film in the window, through shaders/display/display.frag."""

from dataclasses import replace
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field
from pydantic.dataclasses import dataclass

from fragtracer.apps.viewer.bloom import Bloom
from fragtracer.apps.viewer.lit_film import ShownFilm
from fragtracer.apps.viewer.meter import Meter
from fragtracer.apps.viewer.programs import Programs
from fragtracer.gpu.program import FullscreenProgram

ToneCurve = Literal["linear", "reinhard", "aces", "agx"]
View = Literal["radiance", "samples", "standard error", "non-finite", "normals", "depth", "albedo", "bloom"]
_VIEWS: dict[str, str] = {
    "radiance": "VIEW_RADIANCE",
    "samples": "VIEW_SAMPLES",
    "standard error": "VIEW_ERROR",
    "non-finite": "VIEW_NON_FINITE",
    "normals": "VIEW_DATA",
    "depth": "VIEW_DEPTH",
    "albedo": "VIEW_ALBEDO",
    "bloom": "VIEW_BLOOM",
}
AUXILIARY = ("normals", "depth", "albedo")  # views that the tracer renders in place of radiance
_MEAN, _VARIANCE, _HELD, _OTHER, _BLOOM = range(5)  # texture units
_UNITS = {"u_film_mean": _MEAN, "u_film_variance": _VARIANCE, "u_held": _HELD, "u_other": _OTHER, "u_bloom": _BLOOM}

_MOST_SHOWN = 4.0  # times the mean number of samples, at the end of their scale

Rectangle = tuple[int, int, int, int]  # left, bottom, width, height, in pixels of the window


@dataclass(frozen=True)
class DisplaySettings:
    """How radiance becomes a picture; nothing here changes a sample.

    ``exposure`` is in stops, unless ``auto_exposure`` finds them. ``gamma`` bends the result after the sRGB
    transfer function; 1 leaves it. ``bloom`` adds glare, ``bloom_strength`` times that of what is above
    ``bloom_threshold`` after exposure (display/look.py); the view "bloom" shows it alone. ``wipe`` is the
    share of the width that shows the film where there is a picture to compare. ``error_range`` is the
    relative error, and ``depth_range`` the distance in metres, at the end of their scales.
    """

    exposure: Annotated[float, Field(ge=-64, le=64)] = 0.0
    auto_exposure: bool = False
    gamma: Annotated[float, Field(gt=0, le=10)] = 1.0
    bloom: bool = False
    bloom_strength: Annotated[float, Field(gt=0, le=1e6)] = 0.2
    bloom_threshold: Annotated[float, Field(ge=0, le=1e6)] = 1.0
    tone_curve: ToneCurve = "linear"
    view: View = "radiance"
    wipe: Annotated[float, Field(ge=0, le=1)] = 0.5
    error_range: Annotated[float, Field(gt=0)] = 0.2
    depth_range: Annotated[float, Field(gt=0)] = 10.0

    @property
    def has_bloom(self) -> bool:
        """Whether glare is to be computed."""
        return self.view == "bloom" or (self.bloom and self.view in ("radiance", "non-finite"))


class Display:
    """The programs that draw a film into a rectangle of the window of ``context``.

    Each view is a program of its own: in a single program with branches, a software renderer would
    execute all of them.
    """

    def __init__(self, context: Any) -> None:
        self._context = context
        self._programs = Programs(context)
        self._picture: Any = None
        self._picture_buffer: Any = None
        self._other: Any = None
        self._bloom, self._meter = Bloom(context, self._programs), Meter(context, self._programs)

    def compare_with(self, image: NDArray[np.float32] | None) -> None:
        """Show a picture, (height, width, 3), right of the wipe; None removes it."""
        if self._other is not None:
            self._other.release()
            self._other = None
        if image is not None:
            height, width, _ = image.shape
            pixels = np.ones((height, width, 4), np.float32)
            pixels[..., :3] = image[::-1]
            self._other = self._context.texture((width, height), 4, pixels.tobytes(), dtype="f4")

    @property
    def compares(self) -> bool:
        return self._other is not None

    @property
    def is_adapted(self) -> bool:
        """Whether automatic exposure has come to rest."""
        return self._meter.is_adapted

    def picture(self, film: ShownFilm, settings: DisplaySettings, spp: int) -> NDArray[np.uint8]:
        """All of ``film`` as :meth:`draw` shows it, (height, width, 3) sRGB bytes, row 0 at the top.

        Raises
        ------
        ShaderError
            If a program that is new does not compile.
        """
        width, height = film.size
        target = self._context.simple_framebuffer(film.size, 3)
        try:
            self.draw(target, film, (0, 0, width, height), replace(settings, wipe=1.0), spp)
            pixels = np.frombuffer(target.read(target.viewport, 3, alignment=1), np.uint8)
        finally:
            self._context.detect_framebuffer(0).use()  # moderngl would bind the released one again
            target.release()
        return np.ascontiguousarray(pixels.reshape(height, width, 3)[::-1])

    def draw(
        self,
        target: Any,
        film: ShownFilm,
        rectangle: Rectangle,
        settings: DisplaySettings,
        spp: int,
        held: ShownFilm | None = None,
        held_weight: float = 0.0,
    ) -> None:
        """Draw ``film``, with ``spp`` samples per pixel, into the framebuffer ``target``, blended with
        ``held`` of weight ``held_weight``.

        Raises
        ------
        ShaderError
            If a program that is new does not compile. Another framebuffer may be bound then.
        """
        mean, variance, _ = film.textures
        mean.use(_MEAN)
        variance.use(_VARIANCE)
        exposure = 2.0 ** (self._meter.follow(film) if settings.auto_exposure else settings.exposure)
        mean.use(_MEAN)
        (held.textures[0] if held is not None else mean).use(_HELD)
        (self._other or mean).use(_OTHER)
        enlarges = held is None and not self.compares and film.size[0] * film.size[1] < rectangle[2] * rectangle[3] / 2
        place = (0, 0, *film.size) if enlarges else rectangle
        picture = {"u_held_weight": held_weight, "u_wipe": settings.wipe, "u_exposure": exposure}
        size = rectangle[2:]
        if settings.has_bloom:
            shown = {"FILM_FITS": int(film.size == size), "HAS_HELD": int(held is not None)}
            self._bloom.draw(size, shown | {"HAS_OTHER": int(self.compares)}, picture, settings.bloom_threshold)
            self._bloom.result.use(_BLOOM)
        program = self._program(settings, film.size == place[2:], held is not None)
        ranges = {"samples": max(spp, 1) * (_MOST_SHOWN if film.is_uneven else 1.25), "depth": settings.depth_range}
        program.set(
            picture
            | {
                "u_rectangle": tuple(float(x) for x in place),
                "u_bloom_size": self._bloom.covered(size),
                "u_bloom_strength": settings.bloom_strength,
                "u_inverse_gamma": 1 / settings.gamma,
                "u_range": ranges.get(settings.view, settings.error_range),
            }
        )
        _draw_into(self._small(film.size) if enlarges else target, place, program)
        if enlarges:
            self._enlarge(target, rectangle)

    def _small(self, size: tuple[int, int]) -> Any:
        """A framebuffer for a picture to be enlarged, which costs less than to enlarge radiance."""
        if self._picture is None or self._picture.size != size:
            self._release_picture()
            self._picture = self._context.texture(size, 4)
            self._picture.repeat_x = self._picture.repeat_y = False
            self._picture_buffer = self._context.framebuffer([self._picture])
        return self._picture_buffer

    def _enlarge(self, target: Any, rectangle: Rectangle) -> None:
        self._picture.use(_MEAN)
        program = self._programs.get("display/enlarge.frag", {"u_picture": _MEAN})
        program.set({"u_rectangle": tuple(float(x) for x in rectangle)})
        _draw_into(target, rectangle, program)

    def _release_picture(self) -> None:
        if self._picture is not None:
            self._context.detect_framebuffer(0).use()  # moderngl would bind the released one again
            self._picture_buffer.release()
            self._picture.release()
            self._picture = None

    def _program(self, settings: DisplaySettings, fits: bool, holds: bool) -> FullscreenProgram:
        defines: dict[str, int | str] = {
            "TONE_CURVE": f"TONE_{settings.tone_curve.upper()}",
            "VIEW": _VIEWS[settings.view],
            "FILM_FITS": int(fits),
            "HAS_GAMMA": int(settings.gamma != 1),
            "HAS_BLOOM": int(settings.has_bloom),
            "HAS_HELD": int(holds),
            "HAS_OTHER": int(self.compares),
        }
        return self._programs.get("display/display.frag", _UNITS, defines)

    def reload_shaders(self) -> None:
        """Compile the shader files again, and draw with them.

        Raises
        ------
        ShaderError
            If one that was used does not compile. The last programs stay in use.
        """
        self._programs.reload()
        self._meter.forget()

    def release(self) -> None:
        self.compare_with(None)
        self._release_picture()
        self._bloom.release()
        self._programs.release()


def _draw_into(target: Any, rectangle: Rectangle, program: FullscreenProgram) -> None:
    target.use()
    target.viewport = target.scissor = rectangle
    program.draw()
