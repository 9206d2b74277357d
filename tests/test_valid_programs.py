# SPDX-License-Identifier: MIT
"""Every program that scenes ask for is valid in both languages."""

import re
import shutil
import subprocess
from collections.abc import Iterable, Mapping
from pathlib import Path

import pytest
from random_programs import covering_programs

from fragtracer.io.toml import load
from fragtracer.packing import PackedScene, pack
from fragtracer.resources import folder
from fragtracer.shader_composer import CONSTANTS, FEATURES, LANGUAGES, compose

SHADERS = folder("shaders")
SHOWS = ("display/display.frag", "display/picture.glsl", "display/tone.glsl")


def validate(tmp_path: Path, sources: Iterable[str], stage: str = "frag") -> None:
    """All at once: the program takes longer to start than to check."""
    program = shutil.which("glslangValidator")
    if program is None:
        pytest.skip("glslangValidator is not installed (Debian: glslang-tools)")
    paths = []
    for i, text in enumerate(sources):
        paths.append(tmp_path / f"{i}.{stage}")
        paths[-1].write_text(text)
    for batch in (paths[i : i + 50] for i in range(0, len(paths), 50)):
        done = subprocess.run([program, *batch], capture_output=True, text=True, check=False)
        wrong = [line for line in done.stdout.splitlines() if "ERROR" in line]
        assert done.returncode == 0, "\n".join(wrong[:20])


def tracer_source(packed: PackedScene, language: str, switches: Mapping[str, int] | None = None) -> str:
    generated = {"generated/scene_layout.glsl": packed.layout}
    defines = {**packed.defines, **(switches or {})}
    return compose("pathtracer.frag", defines, SHADERS, generated, packed.constants, language).text


@pytest.mark.parametrize("language", LANGUAGES)
def test_programs_of_all_features_are_valid(tmp_path: Path, language: str) -> None:
    """Every two features that occur together in a thousand random scenes do so in one of these."""
    programs = covering_programs(1000)
    validate(tmp_path, (tracer_source(packed, language, switches) for packed, switches in programs))


@pytest.mark.parametrize("language", LANGUAGES)
def test_programs_of_the_bundled_scenes_are_valid(tmp_path: Path, language: str) -> None:
    scenes = [load(path.stem) for path in sorted(folder("scenes").glob("*.toml"))]
    assert len(scenes) >= 10
    packed = [pack(scene, scene.render, 64, 48, baked) for scene in scenes for baked in (False, True)]
    validate(tmp_path, (tracer_source(p, language) for p in packed))


@pytest.mark.parametrize("language", LANGUAGES)
def test_other_programs_are_valid(tmp_path: Path, language: str) -> None:
    """The one that shows the image, with every value of each of its features, those of maps, the vertex shader."""
    names = features_of(*SHOWS)
    settings = [dict.fromkeys(names, 1)]
    for name in names:
        choices = [v for c, v in CONSTANTS.items() if c.startswith(f"{name.removesuffix('_CURVE')}_")]
        settings += [{name: value} for value in choices or (0, 1)]
    validate(tmp_path, (compose("display/display.frag", s, SHADERS, language=language).text for s in settings))
    maps = sorted(path.relative_to(SHADERS).as_posix() for path in SHADERS.glob("split_sum/*.frag"))
    assert maps
    validate(tmp_path, [compose(path, {}, SHADERS, language=language).text for path in maps])
    passes = [v for name, v in CONSTANTS.items() if name.startswith("BLOOM_")]  # of any radius
    blooms = [
        {"BLOOM_PASS": kind, "HAS_HELD": flag, "HAS_OTHER": flag, "FILM_FITS": flag}
        for kind in passes
        for flag in (0, 1)
    ]
    validate(tmp_path, (compose("display/bloom.frag", s, SHADERS, language=language).text for s in blooms))
    validate(tmp_path, [compose("display/meter.frag", {}, SHADERS, language=language).text])
    validate(tmp_path, [compose("fullscreen.vert", {}, SHADERS, language=language).text], "vert")


def features_of(*files: str) -> list[str]:
    """The features that the conditions of files ask for."""
    text = "\n".join((SHADERS / name).read_text() for name in files)
    conditions = re.findall(r"^\s*#\s*(?:if|elif)(.*)", text, re.MULTILINE)
    return sorted(set(re.findall(r"\w+", " ".join(conditions))) & set(FEATURES))


def test_every_feature_takes_part() -> None:
    """One that no test program ever changes would be one that nobody compiles."""
    values: dict[str, set[int]] = {name: set() for name in FEATURES}
    for packed, switches in covering_programs(1000):
        for name, value in {**packed.defines, **switches}.items():
            values[name].add(value)
    never = {name for name, found in values.items() if len(found) < 2} - set(features_of(*SHOWS, "display/bloom.frag"))
    assert never == {"BLOOM_RADIUS", "RANDOM_TEXTURE_WIDTH", "RANDOM_TEXTURE_LAYERS", "MESH_STACK"}


@pytest.mark.skipif(shutil.which("glslangValidator") is None, reason="glslangValidator is not installed")
def test_wrong_programs_are_found_out(tmp_path: Path) -> None:
    """What GLSL ES lacks, what is misspelt, and what only some drivers let pass."""
    for line in ("float x = 1;", "uniform samplerBuffer u_b;", "float x = sine(1.0);", "float x = 1.0f + 1;"):
        with pytest.raises(AssertionError, match="ERROR"):
            validate(tmp_path, [LANGUAGES["300 es"] + f"precision highp float;\n{line}\nvoid main() {{}}"])
