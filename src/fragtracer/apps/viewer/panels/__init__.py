# SPDX-License-Identifier: MIT
"""The panels: each reads a value and returns the edited one. No OpenGL in here."""
