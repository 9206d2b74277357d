# SPDX-License-Identifier: MIT
"""What a person does with the viewer, and what should be seen then: ``python scenarios looking.orbits`` plays that.

Each function of the modules here is run by test_viewer.py in a process of its own, in an empty folder.
"""

import sys
from importlib import import_module

module, name = sys.argv[1].split(".")
getattr(import_module(module), name)()
