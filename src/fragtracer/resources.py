# SPDX-License-Identifier: MIT
"""Finds the shaders and scenes: inside the installed package, or at the top of a checkout."""

from pathlib import Path

_PACKAGE = Path(__file__).resolve().parent
_CHECKOUT = _PACKAGE.parents[1]


def folder(name: str) -> Path:
    """The folder of bundled data called ``name`` ("shaders" or "scenes").

    Raises
    ------
    FileNotFoundError
        If the installation is broken: the folder is neither in the package nor in a checkout.
    """
    for parent in (_PACKAGE, _CHECKOUT):
        if (parent / name).is_dir():
            return parent / name
    raise FileNotFoundError(f"fragtracer was installed without its {name} folder; reinstall it")
