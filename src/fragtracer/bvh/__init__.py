# SPDX-License-Identifier: MIT
"""Bounding volume hierarchies: trees of boxes over triangles, for rays to find them by."""

from fragtracer.bvh.tree import Bvh, Layout, build

__all__ = ["Bvh", "Layout", "build"]
