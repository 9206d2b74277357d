# SPDX-License-Identifier: MIT
"""A display for the windows of the tests, the scenarios that drive one, and refiners."""

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import moderngl
import pytest

from fragtracer.apps.viewer.dynamic_resolution import DynamicResolution
from fragtracer.apps.viewer.live import LiveRenderer
from fragtracer.apps.viewer.refiner import Refiner
from fragtracer.gpu import tracer
from fragtracer.scene import Scene

from .refining import SIZE, Make

SCENARIOS = Path(__file__).with_name("scenarios")


@pytest.fixture(scope="session")
def display() -> Iterator[str]:
    """The name of an X display of its own, large enough for a 4K window."""
    if shutil.which("Xvfb") is None or shutil.which("xdotool") is None:
        pytest.skip("needs Xvfb and xdotool: 'make test' installs them, or 'apt install xvfb xdotool'")
    read, write = os.pipe()
    command = ["Xvfb", "-displayfd", str(write), "-screen", "0", "3900x2200x24", "-nolisten", "tcp", "-noreset"]
    server = subprocess.Popen(command, pass_fds=[write], stderr=subprocess.DEVNULL)
    os.close(write)
    with os.fdopen(read) as pipe:
        number = pipe.readline().strip()
    assert number, "Xvfb did not start"
    yield f":{number}"
    server.terminate()
    server.wait()


@pytest.fixture(autouse=True)
def _settings_of_the_tests(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The tests leave the user's folder of settings alone."""
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))


@pytest.fixture(scope="session")
def scenarios() -> Iterator[subprocess.Popen[str]]:
    """The process that scenarios are forked from."""
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
    with subprocess.Popen([sys.executable, str(SCENARIOS)], **pipes) as process:
        yield process


@pytest.fixture
def play(display: str, scenarios: subprocess.Popen[str], tmp_path: Path) -> Callable[[str], None]:
    """Runs a scenario, as "looking.orbits", in a process and folder of its own."""

    def run(name: str) -> None:
        environment = os.environ | {"DISPLAY": display, "XDG_CONFIG_HOME": str(tmp_path / "config")}
        environment.pop("WAYLAND_DISPLAY", None)
        assert scenarios.stdin is not None
        assert scenarios.stdout is not None
        print(json.dumps([name, str(tmp_path), environment]), file=scenarios.stdin, flush=True)
        status = scenarios.stdout.readline()
        assert status == "0\n", (status, (tmp_path / "stderr.txt").read_text("utf-8")[-4000:])

    return run


@pytest.fixture
def make_refiner(ctx: moderngl.Context) -> Iterator[Make]:
    """Makes a refiner of a scene."""
    made: list[Refiner] = []

    def refiner(scene: Scene) -> Refiner:
        made.append(Refiner(LiveRenderer(scene, SIZE, ctx), DynamicResolution()))
        return made[-1]

    with ctx:
        yield refiner
        for each in made:
            each.close()


@pytest.fixture
def compiled(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The programs that have been compiled for tracing."""
    found: list[str] = []
    program = tracer.FullscreenProgram

    def counted(ctx: Any, root: Any, name: str, *rest: Any, **options: Any) -> Any:
        found.append(name)
        return program(ctx, root, name, *rest, **options)

    monkeypatch.setattr(tracer, "FullscreenProgram", counted)
    return found
