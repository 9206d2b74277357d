# SPDX-License-Identifier: MIT
"""Bounding volume hierarchies: trees of boxes over triangles, for rays to find them by."""

from fragtracer.bvh.tree import NONE, WIDTH, Bvh, Layout, build

__all__ = ["NONE", "WIDTH", "Bvh", "Layout", "build"]
