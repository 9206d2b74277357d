# SPDX-License-Identifier: MIT
"""Bounding volume hierarchies: trees of boxes over triangles, for rays to find them by."""

from fragtracer.bvh.tree import Bvh, build

__all__ = ["Bvh", "build"]
