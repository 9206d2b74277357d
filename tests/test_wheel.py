# SPDX-License-Identifier: MIT
"""The wheel works where there is no checkout: its shaders, its scenes and its command are inside."""

import os
import subprocess
import sys
import sysconfig
import venv
from pathlib import Path

import pytest

CHECKOUT = Path(__file__).parents[1]


def _run(*command: str | Path, cwd: Path) -> str:
    environment = {k: v for k, v in os.environ.items() if not k.startswith(("PYTHON", "VIRTUAL_ENV"))}
    done = subprocess.run(command, cwd=cwd, env=environment, stdin=subprocess.DEVNULL, capture_output=True, text=True)
    assert done.returncode == 0, f"{command} failed:\n{done.stdout}\n{done.stderr}"
    return done.stdout


@pytest.fixture(scope="module")
def python(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The Python of an environment that has the wheel, and sees our dependencies but not our checkout."""
    root = tmp_path_factory.mktemp("wheel")
    _run(sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", root, CHECKOUT, cwd=root)
    (wheel,) = root.glob("*.whl")

    venv.create(root / "venv", with_pip=False, symlinks=True)
    python = root / "venv" / "bin" / "python"
    _run(sys.executable, "-m", "pip", "--python", python, "install", "-q", "--no-deps", "--no-index", wheel, cwd=root)
    # A folder that a .pth file names is searched last, and the .pth files in it (our editable
    # installation among them) are not read.
    site_packages = Path(_run(python, "-c", "import sysconfig; print(sysconfig.get_path('purelib'))", cwd=root).strip())
    dependencies = dict.fromkeys(sysconfig.get_path(kind) for kind in ("purelib", "platlib"))
    (site_packages / "dependencies.pth").write_text("\n".join(dependencies))
    return python


def test_shaders_and_scenes_are_in_the_package(python: Path, tmp_path: Path) -> None:
    script = (
        "import sys, fragtracer\n"
        "from fragtracer.resources import folder\n"
        "print(fragtracer.__file__, folder('shaders'), folder('scenes'), *sys.path, sep='\\n')"
    )
    package, shaders, scenes, *search = (Path(line) for line in _run(python, "-c", script, cwd=tmp_path).splitlines())
    assert package.is_relative_to(python.parents[1])
    assert CHECKOUT / "src" not in search
    assert shaders == package.parent / "shaders"
    assert scenes == package.parent / "scenes"
    for name, folder in ("shaders", shaders), ("scenes", scenes):
        ours = {p.relative_to(CHECKOUT / name) for p in (CHECKOUT / name).rglob("*") if p.is_file()}
        assert ours <= {p.relative_to(folder) for p in folder.rglob("*")}
        assert ours


def test_installed_command_lists_the_scenes(python: Path, tmp_path: Path) -> None:
    for command in [python, "-m", "fragtracer"], [python.parent / "fragtracer"]:
        assert "three-spheres" in _run(*command, "scenes", cwd=tmp_path)


def test_installed_command_renders(python: Path, tmp_path: Path) -> None:
    render = ["render", "three-spheres", "-o", "image.png", "--size", "16x16", "--spp", "1"]
    _run(python, "-m", "fragtracer", *render, cwd=tmp_path)
    assert (tmp_path / "image.png").read_bytes().startswith(b"\x89PNG")
