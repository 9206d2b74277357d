# SPDX-License-Identifier: MIT
"""``python -m fragtracer`` is the ``fragtracer`` command."""

from fragtracer.apps.cli import main

if __name__ == "__main__":
    main()
