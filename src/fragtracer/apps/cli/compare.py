# SPDX-License-Identifier: MIT
"""``fragtracer compare`` and ``export-mitsuba``: the same scene in Mitsuba."""

import json as json_format
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fragtracer.apps.cli import options
from fragtracer.errors import FragtracerError

if TYPE_CHECKING:
    from fragtracer.scene import Scene


def compare(
    scene: options.SceneArgument,
    size: options.Size = None,
    spp: Annotated[int | None, typer.Option(min=2, help="Samples per pixel of each renderer.  [default: 1024]")] = None,
    batches: Annotated[
        int | None, typer.Option(min=2, max=1024, help="Independent pictures of each renderer.  [default: 16]")
    ] = None,
    margin: Annotated[
        float | None, typer.Option(min=0.001, max=99.0, help="Equivalence margin, %.  [default: 1]")
    ] = None,
    seed: Annotated[int, typer.Option(min=0, max=2**32 - 1, help="Seed of both renderers.")] = 0,
    bounces: options.Bounces = None,
    light_samples: options.LightSamples = None,
    geometry: options.GeometryTerm = None,
    multiple_scattering: options.MultipleScattering = None,
    variant: Annotated[str | None, typer.Option(help="Mitsuba variant.  [default: llvm_ad_rgb]")] = None,
    split_sum: Annotated[
        bool, typer.Option("--split-sum", help="Compare the split-sum approximation, not Mitsuba, with path tracing.")
    ] = False,
    report: Annotated[Path | None, typer.Option(help="Write a report with pictures, .html.")] = None,
    json: Annotated[Path | None, typer.Option(help="Write all numbers, .json.")] = None,
    denoise: Annotated[bool, typer.Option("--denoise", hidden=True)] = False,
) -> None:
    """Render SCENE here and in Mitsuba and test whether they agree: status 0 yes, 1 no, 2 cannot tell.

    Of a Mitsuba scene, Mitsuba renders the file itself.

    With --split-sum: measure what that approximation gets wrong, error by error; status 0.
    """
    from fragtracer.apps.cli.progress import comparison_progress
    from fragtracer.apps.compare import compare_scene, summary, to_json, write_report
    from fragtracer.apps.compare.page import check_installed
    from fragtracer.io.toml import is_mitsuba, load
    from fragtracer.output import check_writable
    from fragtracer.renderer import warn_if_dark

    _refuse_pictures(scene, denoise)
    for path, suffixes in ((report, {".html"}), (json, {".json"})):
        if path is not None:
            check_writable(path, suffixes)
    if report is not None:
        check_installed()
    settings = {"bounces": bounces, "light_samples": light_samples, "geometry": geometry}
    loaded = options.with_settings(load(scene), multiple_scattering=multiple_scattering, **settings)
    warn_if_dark(loaded)
    pixels = options.parse_size(size)
    numbers: dict[str, Any] = {} if spp is None else {"spp": spp}
    if split_sum:
        mitsuba = {"--batches": batches, "--margin": margin, "--variant": variant, "--geometry": geometry}
        mitsuba["--multiple-scattering"] = multiple_scattering
        if given := [name for name, value in mitsuba.items() if value is not None]:
            raise FragtracerError(f"--split-sum measures without {' and '.join(given)}: leave that out")
        _compare_split_sum(loaded, pixels, numbers | {"seed": seed}, report, json)
        return
    if is_mitsuba(scene) and (geometry is not None or multiple_scattering is not None):
        options_given = "--geometry and --multiple-scattering"
        raise FragtracerError(f"{scene}: Mitsuba's own BSDFs have one geometry term; leave {options_given} out")
    if loaded.render.integrator != "path":
        raise FragtracerError(f"{scene}: only the path integrator can be compared with Mitsuba; use --split-sum")
    with comparison_progress() as progress:
        comparison = compare_scene(
            loaded,
            pixels,
            batches=16 if batches is None else batches,
            seed=seed,
            margin=(1.0 if margin is None else margin) / 100,
            variant=variant,
            progress=progress,
            file=Path(scene) if is_mitsuba(scene) else None,
            **numbers,
        )
    print(summary(comparison))
    _write(json, to_json, report, write_report, comparison)
    raise typer.Exit(comparison.exit_status)


def _refuse_pictures(scene: str, denoise: bool) -> None:
    """What is compared are the means of independent samples; a denoised picture has a bias that nobody knows."""
    from fragtracer.denoising import KEY
    from fragtracer.io.images import READABLE, read_metadata

    if denoise:
        raise FragtracerError("compare tests the mean of samples, and a denoised picture is none; leave --denoise out")
    if Path(scene).suffix.lower() in READABLE:
        what = "a denoised picture" if KEY in read_metadata(scene) else "a picture"
        raise FragtracerError(f"{scene}: this is {what}, and compare renders the scene itself; give the scene")


def _compare_split_sum(
    scene: "Scene", size: tuple[int, int] | None, numbers: dict[str, Any], report: Path | None, json: Path | None
) -> None:
    from fragtracer.apps.cli.progress import comparison_progress
    from fragtracer.apps.compare import approximation_report
    from fragtracer.apps.compare.approximation import measure_approximation

    with comparison_progress() as progress:
        found = measure_approximation(scene, size or (320, 180), progress=progress, **numbers)
    print(approximation_report.summary(found))
    _write(json, approximation_report.to_json, report, approximation_report.write_report, found)


def _write(
    json: Path | None,
    to_json: Callable[[Any], dict[str, Any]],
    report: Path | None,
    write_report: Callable[[Path, Any], None],
    found: Any,
) -> None:
    """Write the files that are asked for; raises as :func:`fragtracer.output.write_each`."""
    from fragtracer.output import replacing, write_each

    def write_json(path: Path) -> None:
        with replacing(path) as part:
            part.write_text(json_format.dumps(to_json(found), indent=2) + "\n", encoding="utf-8")

    writers = {json: write_json, report: lambda path: write_report(path, found)}
    write_each({path: write for path, write in writers.items() if path is not None})


def export_mitsuba(
    scene: options.SceneArgument,
    folder: Annotated[Path, typer.Argument(help="Folder to write scene.xml into.")],
    plugin: Annotated[
        bool, typer.Option(help="Materials as fragtracer's own plugin, not the nearest built-in.")
    ] = False,
) -> None:
    """Write SCENE as a Mitsuba XML file."""
    from fragtracer.io.toml import load
    from fragtracer.reference.export import export_mitsuba as export

    for note in export(load(scene), folder, plugin):
        print(note)
    print(f"{folder / 'scene.xml'}: written")
