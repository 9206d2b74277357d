# SPDX-License-Identifier: MIT
"""What is written of a render: the picture, layers beside it, and its denoised form."""

import tempfile
from collections.abc import Mapping
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from fragtracer.aov import AOVS, DENOISING
from fragtracer.errors import OutputError

WRITING = "interrupted: writing what there is; other signals wait until that is done"


@dataclass(frozen=True)
class Picture:
    """The ``look`` of pictures for screens, the layers ``aovs``, and whether to ``denoise``."""

    look: tuple[float | Literal["auto"], str, float, float, float, bool]
    aovs: tuple[str, ...]
    denoise: bool

    @property
    def is_for_denoiser(self) -> bool:
        return self.denoise or any(name.startswith("denoising_") for name in self.aovs)

    def check(self, output: Path) -> None:
        """Raise OutputError where a file cannot hold the layers, or cannot keep the radiance beside its denoised
        picture, nor say that it is one; FragtracerError where the denoiser is not installed."""
        from fragtracer.denoising import check_installed
        from fragtracer.io.images import check_layers_writable

        if self.aovs:
            check_layers_writable(output)
        if self.denoise and output.suffix.lower() not in (".exr", ".png"):
            raise OutputError(
                f"{output}: only .exr files keep the radiance beside a denoised layer, and .png files are pictures "
                "anyway; give one of these with --denoise"
            )
        if self.denoise:
            check_installed()

    def write(
        self, renderer: Any, output: Path, more: Mapping[str, str] | None = None, previous_camera: Any = None
    ) -> None:
        """Write what ``renderer`` has, with ``more`` metadata; "motion" is from ``previous_camera``."""
        from fragtracer.denoising import KEY, LAYER_KEY, denoise, denoiser

        image, metadata = renderer.image(), renderer.metadata() | dict(more or {})
        layers = {name: renderer.aov(name, previous_camera) for name in self.aovs}
        names = {name: renderer.matte_names(name) for name in self.aovs if AOVS[name].matte}
        if self.denoise:
            clean = denoise(image, *map(renderer.aov, DENOISING))
            if output.suffix.lower() == ".png":
                image, metadata[KEY] = clean, denoiser()
            else:
                layers[KEY], metadata[LAYER_KEY] = clean, denoiser()
        write_or_rescue(output, image, metadata, *self.look, layers=layers, matte_names=names)


def write_or_rescue(output: Path, *what: Any, **more: Any) -> None:
    """Write an image, as :func:`fragtracer.io.images.write_image` does; where that cannot be, as on a disk that has
    become full, in a new folder of the current one or of that of temporary files.

    Raises
    ------
    OutputError
        If it is not in ``output``; the message says where it is.
    """
    from fragtracer.io.images import write_image

    try:
        write_image(output, *what, **more)
    except OutputError as error:
        rescued = _rescued(output.name, *what, **more)
        if rescued is None:
            raise
        raise OutputError(f"{error}; the picture is in {rescued}") from error


def _rescued(name: str, *what: Any, **more: Any) -> Path | None:
    from fragtracer.io.images import write_image

    for parent in (Path.cwd(), Path(tempfile.gettempdir())):
        with suppress(OSError, OutputError), ExitStack() as failing:
            folder = Path(tempfile.mkdtemp(prefix="rescued-", dir=parent))
            failing.callback(folder.rmdir)
            write_image(folder / name, *what, **more)
            failing.pop_all()
            return folder / name
    return None
