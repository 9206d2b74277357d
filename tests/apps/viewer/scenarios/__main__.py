# SPDX-License-Identifier: MIT
"""What a person does with the viewer, and what should be seen then: ``python scenarios looking.orbits`` plays that.

Each function of the modules here is run by test_viewer.py in a process of its own, in an empty folder. Without a name
this is the process that those are forked from, so that they need not import everything: it reads lines of a name, a
folder, and the environment, as JSON, and answers each with the exit status, after what was printed is in the folder.
"""

import json
import os
import sys
import traceback
from importlib import import_module
from pathlib import Path
from typing import NoReturn

sys.path.append(str(Path(__file__).parents[3]))  # what all tests share


def play(scenario: str) -> None:
    module, name = scenario.split(".")
    getattr(import_module(module), name)()


def play_as(scenario: str, folder: str, environment: dict[str, str]) -> NoReturn:
    """In a process that was forked for it."""
    status = 1
    try:
        os.chdir(folder)
        os.environ.clear()
        os.environ.update(environment)
        for number, (path, mode) in enumerate(((os.devnull, os.O_RDONLY), *OUTPUTS)):
            os.dup2(os.open(path, mode, 0o600), number)
        play(scenario)
        status = 0
    except BaseException:
        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(status)


OUTPUTS = tuple((name, os.O_WRONLY | os.O_CREAT | os.O_TRUNC) for name in ("stdout.txt", "stderr.txt"))

if len(sys.argv) > 1:
    play(sys.argv[1])
else:
    for path in Path(__file__).parent.glob("[!_]*.py"):
        import_module(path.stem)
    for line in sys.stdin:
        if (child := os.fork()) == 0:
            play_as(*json.loads(line))
        print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)
