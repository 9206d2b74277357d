# SPDX-License-Identifier: MIT
"""``fragtracer scenes``: the bundled scenes."""


def scenes() -> None:
    """List the bundled scenes and what each shows."""
    from fragtracer.io.toml import bundled

    for name, description in bundled().items():
        print(f"{name:22} {description}")
