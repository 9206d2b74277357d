# SPDX-License-Identifier: MIT
"""Images over surfaces: read from files, and laid out for the GPU."""

from fragtracer.textures.files import read_texture

__all__ = ["read_texture"]
