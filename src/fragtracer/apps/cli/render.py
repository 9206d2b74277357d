# SPDX-License-Identifier: MIT
"""``fragtracer render``: a scene into an image file."""

import math
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from fragtracer.apps.cli import options
from fragtracer.apps.cli.words import counted, finished_before
from fragtracer.errors import FragtracerError
from fragtracer.interruption import deferred, once

_BADLY_EXPOSED = 5  # stops from automatic exposure

Output = Annotated[
    Path, typer.Option("--output", "-o", help="Image: .exr, .hdr, .npy (radiance), .png; film: .mp4, .webm.")
]
Spp = Annotated[int | None, typer.Option(min=1, max=2**24, help="Samples per pixel.  [default: the scene's]")]
Time = Annotated[float | None, typer.Option(min=0.0, metavar="SECONDS", help="Stop after sampling for this time.")]
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
FirstSample = Annotated[
    int | None,
    typer.Option(
        "--first-sample", min=0, max=2**24, help="Number of the first sample, to merge films of disjoint samples."
    ),
]
Checkpoint = Annotated[
    Path | None, typer.Option(metavar="DIR", help="Keep the film in this folder while it is rendered (docs/films.md).")
]
Every = Annotated[float | None, typer.Option(min=0.0, metavar="SECONDS", help="Time between checkpoints, 60.")]
Resume = Annotated[bool, typer.Option("--resume", help="Go on from the checkpoint, if there is one.")]
Cluster = Annotated[
    str | None,
    typer.Option(metavar="ADDRESS", help="Render on a Dask cluster: tcp://host:8786, or local:N (docs/cluster.md)."),
]
BlockSamples = Annotated[
    int | None,
    typer.Option("--block", min=2, max=2**20, metavar="SAMPLES", help="Of a task of the cluster at most, 256."),
]
FrameRange = Annotated[
    str | None,
    typer.Option("--frames", metavar="A-B", help="Frames of a moving camera or an animation.  [default: all]"),
]
CameraPathFile = Annotated[
    Path | None, typer.Option("--path", metavar="FILE", help="Keyframes of the camera, a .toml file (docs/films.md).")
]
Turntable = Annotated[
    int | None, typer.Option(min=1, max=100_000, metavar="FRAMES", help="Turn the camera once around its target.")
]
Fps = Annotated[
    float | None, typer.Option(min=1, max=1000, help="Frames per second of a film, or while an animation plays, 24.")
]
AnimationName = Annotated[
    str | None,
    typer.Option("--animation", metavar="NAME", help="Pose a glTF model by this animation of its; in frames, play it."),
]
AnimationTime = Annotated[
    float | None,
    typer.Option("--animation-time", metavar="SECONDS", help="Hold this moment of the animation.  [default: play it]"),
]
Loop = Annotated[bool, typer.Option("--loop", help="Begin an animation anew when it ends, while the camera moves.")]
OpenShutter = Annotated[
    float,
    typer.Option(
        "--shutter", min=0, max=1, metavar="SHARE", help="Motion blur, over this share of a frame; 0.5: 180°."
    ),
]
Moments = Annotated[
    int | None, typer.Option(min=1, max=2**16, metavar="N", help="Of an open shutter that a frame shows at most, 32.")
]
_PATIENCE = 0.5  # seconds until there is a progress bar, which takes time to make


def render(
    context: typer.Context,
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
    light_tracing: options.LightTracing = None,
    gradient_domain: options.GradientDomain = None,
    environment: options.EnvironmentFile = None,
    environment_rotation: options.EnvironmentRotation = None,
    environment_strength: options.EnvironmentStrength = None,
    integrator: Annotated[Literal["path", "split-sum"] | None, typer.Option(help="How light is found.")] = None,
    first_sample: FirstSample = None,
    checkpoint: Checkpoint = None,
    every: Every = None,
    resume: Resume = False,
    frames: FrameRange = None,
    path: CameraPathFile = None,
    turntable: Turntable = None,
    fps: Fps = None,
    animation: AnimationName = None,
    animation_time: AnimationTime = None,
    loop: Loop = False,
    shutter: OpenShutter = 0.0,
    moments: Moments = None,
    cluster: Cluster = None,
    block: BlockSamples = None,
    exposure: options.Exposure = "0",
    tonemap: options.Tonemap = "linear",
    gamma: options.Gamma = 1.0,
    bloom: options.Bloom = 0.0,
    bloom_threshold: options.BloomThreshold = 1.0,
    bloom_alone: options.BloomAlone = False,
    aov: Aovs = None,
    denoise: options.Denoise = False,
) -> None:
    """Render SCENE into an image file, or a film of a moving camera or an animation. Ctrl-C writes what there is."""
    from fragtracer.aov import checked
    from fragtracer.apps.cli import video
    from fragtracer.apps.cli.keeping import keeping
    from fragtracer.apps.cli.picture import Picture
    from fragtracer.apps.cli.preparation import preparing
    from fragtracer.display.look import Look
    from fragtracer.io.images import check_writable
    from fragtracer.io.playing import Playing
    from fragtracer.io.toml import is_model, load
    from fragtracer.renderer import Renderer, expected_spp, warn_if_dark

    moves = any(option is not None for option in (frames, path, turntable, fps))
    moves |= output.suffix.lower() in video.SUFFIXES
    if not moves:
        check_writable(output)
    look = (options.parse_exposure(exposure), tonemap, gamma, bloom, bloom_threshold, bloom_alone)
    Look(*look)  # refused here, not after the work
    picture = Picture(look, tuple(checked(aov or ())), denoise)
    if not moves:
        picture.check(output)
    if checkpoint is None and (resume or every is not None):
        raise FragtracerError(f"{'--resume' if resume else '--every'} needs --checkpoint DIR, the folder of the film")
    settings: dict[str, Any] = {
        "bounces": bounces,
        "rays": rays,
        "light_samples": light_samples,
        "adaptive": None if adaptive is None else "on" if adaptive else "off",
        "seed": seed,
        "spp": spp,
        **dict(zip(("width", "height"), options.parse_size(size) or (), strict=False)),
        "russian_roulette": russian_roulette,
        "geometry": geometry,
        "multiple_scattering": multiple_scattering,
        "estimator": estimator,
        "sampler": sampler,
        "pixel_filter": pixel_filter,
        "guiding": guiding,
        "light_tracing": light_tracing,
        "gradient_domain": gradient_domain,
        "integrator": integrator,
    }
    loaded = load(scene, environment in (None, "none"), animation, animation_time)
    lit = options.with_environment(loaded, environment, environment_rotation, environment_strength)
    lit = options.with_settings(lit, **settings)
    if picture.is_for_denoiser and lit.render.gradient_domain == "auto":
        lit = options.with_settings(lit, gradient_domain="off")  # denoisers take pixels to be independent
    limits = {"spp": spp, "seconds": time, "until": _share(until), "worst": _share(worst)}
    if time is not None:
        lit = options.with_settings(lit, spp=expected_spp(lit.render, spp, time))
    playing = (Playing(lit, is_model(scene), loop) or None) if moves or "#" in output.name else None
    moves |= playing is not None
    if loop and playing is None:
        raise FragtracerError("--loop is for frames while an animation plays; name one by --animation, or leave it out")
    if playing is not None and "motion" in picture.aovs:
        raise FragtracerError("--aov motion knows moving cameras alone; leave it out where an animation plays")
    if moments is not None and not shutter:
        raise FragtracerError(
            "--moments is how many of an open shutter there are; give --shutter SHARE, or leave it out"
        )
    if shutter:
        _check_shutter(moves, picture, cluster)
    if cluster is None and block is not None:
        raise FragtracerError("--block is the size of a task of --cluster ADDRESS; leave it out without")
    if cluster is not None:
        from fragtracer.apps.cli import on_cluster

        on_cluster.check_options(limits, picture, moves, first_sample)
    if moves and first_sample is not None:
        raise FragtracerError("--first-sample is for one picture; leave it out where the camera moves")
    warn_if_dark(lit)
    context.with_resource(once())
    kept = None
    if checkpoint is not None:
        kept = context.with_resource(keeping(checkpoint, 60.0 if every is None else every, resume))
    if moves:
        from fragtracer.apps.cli.frames import frames_of

        moving = frames_of(lit, output, frames, path, turntable, fps, playing, shutter, moments or 32)
        if cluster is not None:
            _with_limit(limits, lit.render)
            finished = on_cluster.render_frames(moving, cluster, block, limits, picture, kept, _progress)
        else:
            finished = _render_frames(moving, limits, picture, kept)
        if finished and moving.film is not None:
            video.encode(list(moving.files.values()), moving.film, moving.fps)
            print(f"{moving.film}: {counted(len(moving.files), 'frame')}, {float(moving.fps):g} a second")
    elif cluster is not None:
        _with_limit(limits, lit.render)
        finished = on_cluster.render_picture(lit, cluster, block, limits, output, picture, kept, _progress)
    else:
        if first_sample is not None:  # for films that are to be merged
            _check_parts(lit.render, picture, first_sample)
            choices = {"light_tracing": light_tracing, "gradient_domain": gradient_domain}
            lit = options.with_settings(lit, **{name: "off" for name, choice in choices.items() if choice is None})
        with preparing():
            renderer = Renderer(lit, first_sample=first_sample or 0, aovs=picture.aovs)
        with renderer:
            with preparing():
                keeper = kept and kept.begin(renderer)
            finished = _sample(renderer, limits, keeper)
            if renderer.spp:
                with deferred():
                    picture.write(renderer, output)
                _report(renderer, output, finished, denoise)
                _say_if_badly_exposed(renderer, output, picture.look[0])
            else:
                print(f"{output}: interrupted before the first sample; not written", file=sys.stderr)
    if not finished:
        raise typer.Exit(130)


def _check_parts(settings: Any, picture: Any, first_sample: int) -> None:
    """Raise FragtracerError where samples cannot begin with ``first_sample``."""
    from fragtracer.aov import AOVS

    if any(AOVS[name].is_light for name in picture.aovs):
        raise FragtracerError("--first-sample is for pictures without layers of light; leave out one of the two")
    if first_sample % 2:
        raise FragtracerError(
            f"--first-sample {first_sample}: give an even number; samples belong to two streams in turns"
        )
    if settings.adaptive != "off":
        raise FragtracerError("--first-sample needs --no-adaptive: only films that are sampled evenly can be merged")
    if settings.light_tracing == "on":
        raise FragtracerError("--first-sample needs --light-tracing off: only films of paths alone can be merged")
    if settings.gradient_domain == "on":
        raise FragtracerError("--first-sample needs --gradient-domain off: only films of single pixels can be merged")
    if settings.integrator != "path":
        raise FragtracerError("--first-sample needs --integrator path")


def _check_shutter(moves: bool, picture: Any, cluster: str | None) -> None:
    """Raise FragtracerError where the shutter cannot be open for more than a moment."""
    if not moves:
        frames = "--turntable, --path, or --animation with -o NAME.####.png"
        raise FragtracerError(f"--shutter is for frames of what moves; give {frames}, or leave it out")
    if "motion" in picture.aovs:
        raise FragtracerError("--aov motion is of a moment; leave it out with --shutter")
    if cluster is not None:
        raise FragtracerError("--shutter is not possible together with --cluster; leave one of them out")


def _render_frames(frames: Any, limits: dict[str, Any], picture: Any, keeping: Any) -> bool:
    """Render the frames that are not finished; False if interrupted."""
    from fragtracer.apps.cli.frames import digest_of, exposed_alike, is_finished
    from fragtracer.apps.cli.preparation import preparing
    from fragtracer.renderer import Renderer

    files = frames.files
    picture.check(files[min(files)])
    frames.make_folder()
    picture = exposed_alike(picture, frames)
    with preparing():
        animated = frames.playing is not None
        renderer = Renderer(frames.base, moves=True, animated=animated, pictures=frames.count, aovs=picture.aovs)
    with renderer:
        done = 0
        for number, file in files.items():
            moved, previous = frames.scene(number), frames.previous_camera(number)
            motion = previous if "motion" in picture.aovs else None
            shutter = frames.shutter(number)
            digest = digest_of(renderer, moved, shutter, moved.render.spp, limits, picture, motion)
            if is_finished(file, digest):
                done += 1
                continue
            renderer.reset(moved, shutter, seed=moved.render.seed)
            keeper = keeping and keeping.begin(renderer, f"{number:04}")
            if not _sample(renderer, dict(limits), keeper, keeper is not None):
                how = "the same command" if keeper is None else "the same command with --resume"
                print(f"{file}: interrupted; {how} goes on with this frame", file=sys.stderr)
                return False
            more = {"frame": str(number), "frame_digest": digest}
            with deferred():
                picture.write(renderer, file, more, previous)
            _report(renderer, file, True, picture.denoise)
            if keeper is not None:
                keeper.remove()
    if done:
        print(finished_before(done, len(files)))
    return True


def _share(percent: float | None) -> float | None:
    return None if percent is None else percent / 100


def _sample(renderer: Any, limits: dict[str, Any], keeper: Any, is_kept: bool = True) -> bool:
    """Render, under a progress bar if it takes long; False if the user interrupted. Says then that what there is is
    being written, if it ``is_kept``."""
    from fragtracer.apps.cli.picture import WRITING

    _with_limit(limits, renderer.settings)
    with _progress(limits, renderer.settings.width * renderer.settings.height) as report:
        try:
            renderer.render(**limits, progress=report, keep=keeper)
        except KeyboardInterrupt:
            if renderer.spp and is_kept:
                print(WRITING, file=sys.stderr)
            return False
        finally:
            if keeper is not None:
                keeper.finish()
    return True


def _with_limit(limits: dict[str, Any], settings: Any) -> None:
    if not any(limit is not None for limit in limits.values()):
        limits["spp"] = settings.spp


@contextmanager
def _progress(limits: dict[str, Any], pixels: int) -> Iterator[Callable[[Any], None]]:
    """What to call with each :class:`fragtracer.renderer.Progress`; it shows a bar if that takes long."""
    bar: Any = None
    with ExitStack() as stack:

        def report(state: Any) -> None:
            nonlocal bar
            if bar is None and state.seconds >= _PATIENCE:
                from fragtracer.apps.cli.progress import render_progress

                bar = stack.enter_context(render_progress(limits["spp"], limits["seconds"], pixels))
            if bar is not None:
                bar(state)

        yield report


def _say_if_badly_exposed(renderer: Any, output: Path, exposure: float | Literal["auto"]) -> None:
    from fragtracer.display.exposure import automatic_exposure

    if output.suffix.lower() != ".png" or exposure == "auto":
        return
    stops = automatic_exposure(renderer.image())
    if abs(stops - exposure) >= _BADLY_EXPOSED:
        said = "white" if stops < exposure else "black"
        hint = f"--exposure auto, here {stops:.1f} stops, shows more"
        print(f"{output}: this is nearly all {said}; {hint}", file=sys.stderr)


def _report(renderer: Any, output: Path, finished: bool, denoised: bool) -> None:
    note = "" if finished else ", interrupted"
    error = renderer.relative_error()  # of one sample there is none, and where it overflows a float32
    found = f"{100 * error:.2g} % mean error" if math.isfinite(error) else "mean error not known"
    found += " before it was denoised" if denoised else ""
    print(f"{output}: {renderer.spp} samples per pixel{note}, {found}")
    if bad := renderer.non_finite_samples():
        print(f"fragtracer: warning: {bad} samples were not finite and are left out of the image", file=sys.stderr)
