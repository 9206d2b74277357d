# SPDX-License-Identifier: MIT
"""``fragtracer render``: a scene into an image file."""

import math
import sys
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from fragtracer.apps.cli import options

Output = Annotated[Path, typer.Option("--output", "-o", help="Image file: .exr, .hdr, .npy (linear radiance) or .png.")]
Spp = Annotated[int | None, typer.Option(min=1, max=2**24, help="Samples per pixel.  [default: the scene's]")]
Time = Annotated[float | None, typer.Option(min=0.0, metavar="SECONDS", help="Stop after this time.")]
Until = Annotated[
    float | None, typer.Option(min=0.0, metavar="PERCENT", help="Stop at this mean relative standard error.")
]

Worst = Annotated[
    float | None,
    typer.Option(min=0.0, metavar="PERCENT", help="Stop when 99 % of the pixels have at most this relative error."),
]
Aovs = Annotated[
    list[str] | None,
    typer.Option(metavar="LAYER,...", help="Write layers beside the picture, .exr: albedo, normal, ..., or all."),
]
_PATIENCE = 0.5  # seconds until there is a progress bar, which takes time to make


def render(
    scene: options.SceneArgument,
    output: Output,
    size: options.Size = None,
    spp: Spp = None,
    time: Time = None,
    until: Until = None,
    worst: Worst = None,
    bounces: options.Bounces = None,
    rays: Annotated[int | None, typer.Option(min=1, max=1024, help="Paths per pixel in one pass.")] = None,
    light_samples: options.LightSamples = None,
    adaptive: Annotated[
        bool | None, typer.Option(help="Place samples where the relative error is; left out: where it pays.")
    ] = None,
    seed: Annotated[int | None, typer.Option(min=0, max=2**32 - 1, help="Another seed, other noise.")] = None,
    russian_roulette: Annotated[bool | None, typer.Option(help="End weak paths early, without bias.")] = None,
    geometry: options.GeometryTerm = None,
    multiple_scattering: options.MultipleScattering = None,
    estimator: Annotated[Literal["mis", "nee", "bsdf"] | None, typer.Option(help="How light is sampled.")] = None,
    sampler: Annotated[Literal["texture", "hash"] | None, typer.Option(help="Source of random numbers.")] = None,
    pixel_filter: Annotated[Literal["box", "tent", "gaussian"] | None, typer.Option()] = None,
    guiding: options.Guiding = None,
    environment: options.EnvironmentFile = None,
    environment_rotation: options.EnvironmentRotation = None,
    environment_strength: options.EnvironmentStrength = None,
    integrator: Annotated[Literal["path", "split-sum"] | None, typer.Option(help="How light is found.")] = None,
    exposure: options.Exposure = "0",
    tonemap: options.Tonemap = "linear",
    gamma: options.Gamma = 1.0,
    bloom: options.Bloom = 0.0,
    bloom_threshold: options.BloomThreshold = 1.0,
    bloom_alone: options.BloomAlone = False,
    aov: Aovs = None,
    denoise: options.Denoise = False,
) -> None:
    """Render SCENE into an image file. Ctrl-C writes what there is."""
    from fragtracer.aov import checked
    from fragtracer.display.look import Look
    from fragtracer.io.images import check_layers_writable, check_writable, write_image
    from fragtracer.io.toml import load
    from fragtracer.renderer import Renderer

    check_writable(output)
    look = (options.parse_exposure(exposure), tonemap, gamma, bloom, bloom_threshold, bloom_alone)
    Look(*look)  # refused here, not after the work
    aovs = checked(aov or ())
    if aovs:
        check_layers_writable(output)
    if denoise:
        _check_denoising(output)
    settings: dict[str, Any] = {
        "bounces": bounces,
        "rays": rays,
        "light_samples": light_samples,
        "adaptive": None if adaptive is None else "on" if adaptive else "off",
        "seed": seed,
        "spp": spp,
        "russian_roulette": russian_roulette,
        "geometry": geometry,
        "multiple_scattering": multiple_scattering,
        "estimator": estimator,
        "sampler": sampler,
        "pixel_filter": pixel_filter,
        "guiding": guiding,
        "integrator": integrator,
    }
    loaded = load(scene, light_models=environment in (None, "none"))
    lit = options.with_environment(loaded, environment, environment_rotation, environment_strength)
    with Renderer(options.with_settings(lit, **settings), options.parse_size(size), aovs=aovs) as renderer:
        finished = _sample(renderer, {"spp": spp, "seconds": time, "until": _share(until), "worst": _share(worst)})
        image, metadata, layers, names = _picture(renderer, output, aovs, denoise)
        write_image(output, image, metadata, *look, layers, names)
        _report(renderer, output, finished, denoise)
    if not finished:
        raise typer.Exit(130)


def _check_denoising(output: Path) -> None:
    """Refuse a file that cannot keep the radiance beside its denoised picture, nor say that it is one."""
    from fragtracer.denoise import check_installed
    from fragtracer.errors import OutputError

    if output.suffix.lower() not in (".exr", ".png"):
        raise OutputError(
            f"{output}: only .exr files keep the radiance beside a denoised layer, and .png files are pictures anyway; "
            "give one of these with --denoise"
        )
    check_installed()


def _picture(renderer: Any, output: Path, aovs: Sequence[str], denoise: bool) -> tuple[Any, ...]:
    """The image to write, its metadata, its layers and the names in its mattes."""
    from fragtracer.aov import AOVS
    from fragtracer.denoise import GUIDES, KEY, LAYER_KEY, denoiser
    from fragtracer.denoise import denoise as denoised

    image, metadata = renderer.image(), renderer.metadata()
    if not renderer.spp:  # interrupted before the first sample
        return image, metadata, {}, {}
    layers = {name: renderer.aov(name) for name in aovs}
    names = {name: renderer.matte_names(name) for name in aovs if AOVS[name].matte}
    if denoise:
        clean = denoised(image, *(renderer.aov(name) for name in GUIDES))
        if output.suffix.lower() == ".png":
            return clean, metadata | {KEY: denoiser()}, layers, names
        layers[KEY], metadata[LAYER_KEY] = clean, denoiser()
    return image, metadata, layers, names


def _share(percent: float | None) -> float | None:
    return None if percent is None else percent / 100


def _sample(renderer: Any, limits: dict[str, Any]) -> bool:
    """Render, under a progress bar if it takes long; False if the user interrupted."""
    if not any(limit is not None for limit in limits.values()):
        limits["spp"] = renderer.settings.spp
    pixels = renderer.settings.width * renderer.settings.height
    bar: Any = None
    with ExitStack() as stack:

        def report(state: Any) -> None:
            nonlocal bar
            if bar is None and state.seconds >= _PATIENCE:
                from fragtracer.apps.cli.progress import render_progress

                bar = stack.enter_context(render_progress(limits["spp"], limits["seconds"], pixels))
            if bar is not None:
                bar(state)

        try:
            renderer.render(**limits, progress=report)
        except KeyboardInterrupt:
            return False
    return True


def _report(renderer: Any, output: Path, finished: bool, denoised: bool) -> None:
    note = "" if finished else ", interrupted"
    error = renderer.relative_error()  # of one sample there is none, and where it is no float32
    found = f"{100 * error:.2g} % mean error" if math.isfinite(error) else "mean error not known"
    found += " before it was denoised" if denoised else ""
    print(f"{output}: {renderer.spp} samples per pixel{note}, {found}")
    if bad := renderer.non_finite_samples():
        print(f"fragtracer: warning: {bad} samples were not finite and are left out of the image", file=sys.stderr)
