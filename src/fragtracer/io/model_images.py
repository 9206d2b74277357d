# SPDX-License-Identifier: MIT
"""Image files that a model refers to; those that cannot be read are ignored."""

import os
from dataclasses import dataclass, field
from pathlib import Path

from fragtracer.errors import FragtracerError
from fragtracer.io.textures import read_texture
from fragtracer.scene import Image
from fragtracer.scene.texture import ColorSpace


@dataclass
class ModelImages:
    """Images relative to ``folder``, each read once. ``notes`` lists those that are ignored, and why."""

    folder: Path
    notes: list[str] = field(default_factory=list)
    files: list[Path] = field(default_factory=list)
    _read: dict[tuple[Path, ColorSpace], Image | None] = field(default_factory=dict)

    def get(self, file: str, color_space: ColorSpace) -> Image | None:
        """The image in ``file``; None, with a note, if it cannot be read."""
        path = self._path(file)
        key = path, color_space
        if key not in self._read:
            self.files.append(path)
            try:
                self._read[key] = read_texture(path, color_space)
            except (FragtracerError, ValueError) as error:
                self._read[key] = None
                self.notes.append(str(error).replace(f"{path}: ", f"image {file}: "))
        return self._read[key]

    def _path(self, file: str) -> Path:
        """The path of ``file``; if it does not exist, the file of the same name beside the model, if that does."""
        path = Path(os.path.abspath(self.folder / file))
        beside = path if os.path.exists(path) else Path(os.path.abspath(self.folder / path.name))
        return beside if os.path.isfile(beside) else path
