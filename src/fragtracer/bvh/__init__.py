# SPDX-License-Identifier: MIT
"""Bounding volume hierarchies: trees of bounds over shapes, for rays to find them by."""

from fragtracer.bvh.tree import NONE, Bvh, Layout, build, pairs

__all__ = ["NONE", "Bvh", "Layout", "build", "pairs"]
