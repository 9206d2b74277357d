# SPDX-License-Identifier: MIT
"""Everything that talks to OpenGL; the rest of the package does not import moderngl."""
