# SPDX-License-Identifier: MIT
"""``fragtracer develop``: an image of radiance into a picture, as ``render`` makes it of a scene."""

from pathlib import Path
from typing import Annotated, Any

import typer

from fragtracer.apps.cli import options
from fragtracer.errors import FragtracerError


def develop(
    image: Annotated[Path, typer.Argument(help="Image of linear radiance: .exr, .hdr or .npy.")],
    output: Annotated[Path, typer.Option("--output", "-o", help="Picture file: .png.")],
    exposure: options.Exposure = "0",
    tonemap: options.Tonemap = "linear",
    gamma: options.Gamma = 1.0,
    bloom: options.Bloom = 0.0,
    bloom_threshold: options.BloomThreshold = 1.0,
    bloom_alone: options.BloomAlone = False,
    denoise: options.Denoise = False,
) -> None:
    """Make a picture of IMAGE, with exposure, glare and tone curve; with --denoise from an .exr that was rendered
    with --aov denoising, or albedo,normal."""
    from fragtracer.denoising import LAYER_KEY, check_installed
    from fragtracer.display.look import Look
    from fragtracer.io.images import read_content, write_image
    from fragtracer.output import check_writable

    check_writable(output, {".png"})
    if image.suffix.lower() == ".png":
        raise FragtracerError(
            f"{image}: this is a picture already; give the radiance it was made of: .exr, .hdr or .npy"
        )
    look = (options.parse_exposure(exposure), tonemap, gamma, bloom, bloom_threshold, bloom_alone)
    Look(*look)
    if denoise:
        check_installed()
    pixels, metadata = _denoised(image) if denoise else read_content(image)
    for name in ("frame", "frame_digest", LAYER_KEY):  # it is no frame of a render, and has no layers
        metadata.pop(name, None)
    write_image(output, pixels, metadata, *look)
    stops = Look(*look).stops(pixels)
    print(f"{output}: exposure {stops:+.2f} stops")


def _denoised(path: Path) -> tuple[Any, dict[str, str]]:
    """The image of a file, denoised, and metadata that say so."""
    from fragtracer.aov import DENOISING
    from fragtracer.denoising import KEY, denoise, denoiser
    from fragtracer.io.images import read_layers

    for layers in (DENOISING, ("albedo", "normal")):
        try:
            images, metadata = read_layers(path, layers)
        except FragtracerError as error:
            if not path.is_file():
                raise
            problem = error
        else:
            return denoise(*images), metadata | {KEY: denoiser()}
    raise FragtracerError(f"{problem}; to denoise it later, render it with --aov denoising")
