# SPDX-License-Identifier: MIT
"""scripts/compare_checkouts.py compares a checkout with a copy of it, and uses the code of each."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

CHECKOUT = Path(__file__).parents[3]
SCRIPT = CHECKOUT / "scripts" / "compare_checkouts.py"
QUICK = ("--scenes", "light-size-0,furnace", "--size", "16x9", "--launches", "2", "--runs", "2", "--seconds", "0.02")


def _run(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, str(SCRIPT), *arguments], capture_output=True, text=True, check=False)


def _copy(folder: Path) -> Path:
    for name in ("src", "shaders", "scenes"):
        shutil.copytree(CHECKOUT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__"))
    return folder


def test_a_row_for_each_scene(tmp_path: Path) -> None:
    result = _run(str(_copy(tmp_path)), *QUICK)
    assert result.returncode == 0, result.stderr
    rows = [line for line in result.stdout.splitlines() if re.match(r"\| (light-size-0|furnace) ", line)]
    assert len(rows) == 2
    for row in rows:
        for median, least, greatest in re.findall(r"([\d.]+) \(([\d.]+) to ([\d.]+)\)", row):
            assert 0 < float(least) <= float(median) <= float(greatest)
        assert row.count(" to ") == 2


def test_the_other_checkout_runs_its_own_code(tmp_path: Path) -> None:
    other = _copy(tmp_path)
    with (other / "src" / "fragtracer" / "renderer.py").open("a") as file:
        file.write("\nraise SystemExit('the other one')\n")
    result = _run(str(other), *QUICK)
    assert result.returncode != 0
    assert "the other one" in result.stderr


def test_what_is_no_checkout_is_refused(tmp_path: Path) -> None:
    result = _run(str(tmp_path))
    assert "is no checkout of fragtracer" in result.stderr
