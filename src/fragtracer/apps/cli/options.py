# SPDX-License-Identifier: MIT
"""Options that several commands share."""

import math
import re
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer
import typer.core

from fragtracer.errors import FragtracerError

if TYPE_CHECKING:
    from fragtracer.scene import Scene


class Command(typer.core.TyperCommand):
    """Refuses numbers that are not finite."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        rest: list[str] = super().parse_args(ctx, args)
        for option in self.params:
            value = ctx.params.get(option.name or "")
            if isinstance(value, float) and not math.isfinite(value):
                raise typer.BadParameter(f"{value} is not a finite number.", ctx, param_hint=f"'{option.opts[0]}'")
        return rest


SCENE_HELP = (
    "Name of a bundled scene, or path of a .toml scene, a Mitsuba scene (.xml) or a model: .obj, .ply, .stl, .gltf, "
    ".glb, .npz."
)
SceneArgument = Annotated[str, typer.Argument(help=SCENE_HELP)]
Size = Annotated[
    str | None, typer.Option("--size", metavar="WxH", help="Image size in pixels.  [default: the scene's]")
]
Bounces = Annotated[int | None, typer.Option(min=0, max=10000, help="Scattering events on a path.")]
LightSamples = Annotated[int | None, typer.Option(min=1, max=1024, help="Shadow rays at each vertex.")]
GeometryTerm = Annotated[
    Literal["smith", "smith-height-correlated", "schlick-beckmann", "karis"] | None,
    typer.Option(help="Geometry term of the material."),
]
MultipleScattering = Annotated[
    bool | None, typer.Option(help="Give rough lobes what their facets reflect more than once.")
]
Guiding = Annotated[
    Literal["auto", "on", "off"] | None,
    typer.Option(help="Send paths where photons have found light; auto: where it pays."),
]
LightTracing = Annotated[
    Literal["auto", "on", "off"] | None,
    typer.Option(help="Trace caustics from the lights; auto: where it pays."),
]
GradientDomain = Annotated[
    Literal["auto", "on", "off"] | None,
    typer.Option(help="Make the picture from differences of neighbours; auto: where it pays."),
]
EnvironmentFile = Annotated[
    str | None,
    typer.Option(
        "--environment", metavar="FILE", help='Light the scene by this .hdr or .exr instead; "none" for none.'
    ),
]
EnvironmentRotation = Annotated[
    float | None,
    typer.Option(
        "--environment-rotation", metavar="DEGREES", help="Turn the environment, counter-clockwise from above."
    ),
]
EnvironmentStrength = Annotated[
    float | None, typer.Option("--environment-strength", min=0.0, metavar="FACTOR", help="Times its radiance.")
]

Exposure = Annotated[str, typer.Option(metavar="auto|STOPS", help="Brightness of a .png.")]
Tonemap = Annotated[Literal["linear", "reinhard", "aces", "agx"], typer.Option(help="Tone curve of a .png.")]
Gamma = Annotated[float, typer.Option(help="Bends a .png after the sRGB curve; 1 leaves it.")]
Bloom = Annotated[float, typer.Option(metavar="STRENGTH", help="Glare around bright parts of a .png; 0 for none.")]
BloomThreshold = Annotated[float, typer.Option(metavar="X", help="What is bright, after exposure; 1 is white.")]
BloomAlone = Annotated[bool, typer.Option("--bloom-alone", help="Show the glare and nothing else.")]

Denoise = Annotated[
    bool, typer.Option("--denoise", help="By Open Image Denoise: a .png shows that, an .exr has it as a layer besides.")
]


def parse_size(text: str | None) -> tuple[int, int] | None:
    """(width, height) from "640x480"; None stays None.

    Raises
    ------
    FragtracerError
        If the text is not two whole numbers from 1 to 16384.
    """
    if text is None:
        return None
    match = re.fullmatch(r"(\d{1,5})x(\d{1,5})", text)
    if not match or not all(1 <= int(side) <= 16384 for side in match.groups()):
        raise FragtracerError(f"--size {text}: give width x height in pixels, each from 1 to 16384, as --size 640x480")
    return int(match[1]), int(match[2])


def with_settings(scene: "Scene", **settings: Any) -> "Scene":
    """``scene`` with other render settings; those that are None stay.

    Raises
    ------
    FragtracerError
        If two of them do not go together.
    """
    from pydantic import ValidationError

    changed = {name: value for name, value in settings.items() if value is not None}
    try:
        return replace(scene, render=replace(scene.render, **changed))
    except ValidationError as error:
        raise FragtracerError(error.errors()[0]["msg"].removeprefix("Value error, ")) from None


def parse_exposure(text: str) -> float | Literal["auto"]:
    """Stops, or "auto" as it is.

    Raises
    ------
    FragtracerError
        If it is neither.
    """
    if text == "auto":
        return "auto"
    try:
        return float(text)
    except ValueError:
        raise FragtracerError(f"--exposure {text}: give a number of stops, or auto") from None


def with_environment(scene: "Scene", file: str | None, rotation: float | None, strength: float | None) -> "Scene":
    """``scene`` with the environment that the options ask for; its other lights stay.

    A bare model is to be loaded without the light that it would get otherwise.

    Raises
    ------
    FragtracerError
        If the file cannot be read, a number is no float32, or there is no environment to turn.
    """
    from fragtracer.io.toml.environments import read_panorama
    from fragtracer.scene import Environment
    from fragtracer.scene.fields import LARGEST

    environment = scene.environment
    if file is not None:
        environment = None if file == "none" else Environment(image=read_panorama(file))
    changes = {"rotation_degrees": rotation, "strength": strength}
    changed: dict[str, Any] = {name: value for name, value in changes.items() if value is not None}
    if environment is None and changed:
        raise FragtracerError("this scene has no environment to change; name one with --environment FILE.hdr")
    for name, value in changed.items():
        if not abs(value) <= LARGEST:
            option = "--environment-" + name.removesuffix("_degrees")
            raise FragtracerError(f"{option} {value:g}: give a finite number, at most {LARGEST:g}")
    return replace(scene, environment=replace(environment, **changed) if environment else None)
