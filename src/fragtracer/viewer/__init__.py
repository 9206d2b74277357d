# SPDX-License-Identifier: MIT
"""The interactive viewer: a window in which the picture refines while everything can be changed."""

from fragtracer.viewer.run import view

__all__ = ["view"]
