# SPDX-License-Identifier: MIT
"""The display chain in numpy: exposure, bloom, tone curves (shaders/display/)."""
