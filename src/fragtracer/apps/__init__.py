# SPDX-License-Identifier: MIT
"""What people start: commands, the viewer, the comparison, the benchmark."""
