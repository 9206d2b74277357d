# SPDX-License-Identifier: MIT
"""Pictures that are held against each other bit for bit."""

from typing import Any

import moderngl
from rendering import Image, rendered

from fragtracer.io.toml import load

SIZE = (32, 24)
SPP = 24
# Spheres, a plane, ambient light and gloss in the one; rectangles, an area light and many bounces in the other.
SCENES = ("three-spheres-ambient", "cornell-box")


def picture(ctx: moderngl.Context, name: str, **settings: Any) -> Image:
    """The bundled scene of that name."""
    return rendered(ctx, load(name), SPP, SIZE, **settings)
