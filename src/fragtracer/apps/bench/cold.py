# SPDX-License-Identifier: MIT
"""The first time that a user renders a scene: in new processes, with empty caches."""

import os
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

from fragtracer.errors import FragtracerError
from fragtracer.io.toml import save
from fragtracer.scene import Scene


@contextmanager
def cold_scene(scene: Scene) -> Iterator[Path]:
    """``scene`` in a file of its own."""
    with TemporaryDirectory(prefix="fragtracer-") as folder:
        path = Path(folder) / "scene.toml"
        save(scene, path)
        yield path


def first_picture_seconds(scene: Path, size: tuple[int, int]) -> float:
    """From the start of ``fragtracer render`` to a written picture of one sample per pixel."""
    output = scene.with_suffix(".npy")
    start = time.perf_counter()
    _run("fragtracer", "render", str(scene), "-o", str(output), "--spp", "1", "--size", f"{size[0]}x{size[1]}")
    return time.perf_counter() - start


def compile_seconds(scene: Path, size: tuple[int, int]) -> float:
    """Of the program of the scene."""
    return float(_run("fragtracer.apps.bench.compile_time", str(scene), *map(str, size)))


def _run(module: str, *arguments: str) -> str:
    """What a module of Python prints, in a process that finds neither the driver's cache nor fragtracer's. It finds, or
    leaves to the next, Python's bytecode, which an installation has."""
    with TemporaryDirectory(prefix="fragtracer-") as cache:
        environment = os.environ | {"MESA_SHADER_CACHE_DISABLE": "true", "FRAGTRACER_CACHE": cache}
        environment.pop("PYTHONDONTWRITEBYTECODE", None)
        environment["__GL_SHADER_DISK_CACHE"] = "0"  # NVIDIA's
        child = subprocess.run(
            [sys.executable, "-m", module, *arguments], env=environment, capture_output=True, text=True, check=False
        )
    if child.returncode:
        raise FragtracerError(f"{module} {' '.join(arguments)} failed: {child.stderr.strip()}")
    return child.stdout
