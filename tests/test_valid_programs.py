# SPDX-License-Identifier: MIT
"""Every program that scenes ask for is valid in both languages, and every shader file by itself."""

import re
import shutil
import subprocess
import sys
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

import pytest
from random_programs import PROGRAMS, covering_programs, features_of, plain_skies, program_of

from fragtracer.errors import ShaderError
from fragtracer.gpu.specialise import Level
from fragtracer.io.toml import load
from fragtracer.packing import pack
from fragtracer.resources import folder
from fragtracer.shader_composer import LANGUAGES, compose

pytestmark = pytest.mark.slow
SHADERS = folder("shaders")


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


def test_programs_of_all_features_are_valid(tmp_path: Path) -> None:
    """Every two features that occur together in 300 random scenes do so in one of these; in GLSL ES: the driver of the
    tests compiles GLSL 3.30, which differs in its first line."""
    validate(tmp_path, (program.source("300 es") for program in covering_programs(300, 2)))


def test_programs_of_the_bundled_scenes_are_valid(tmp_path: Path) -> None:
    """In GLSL ES, with nothing compiled in and with everything; the driver compiles those in GLSL 3.30 where the
    scenes are rendered."""
    scenes = [load(path.stem) for path in sorted(folder("scenes").glob("*.toml"))]
    assert len(scenes) >= 10
    with plain_skies():
        packed = [pack(scene, scene.render, 64, 48, most_listed) for scene in scenes for most_listed in (0, 64)]
    programs = [program_of(p, level=level) for p in packed for level in (Level.NOTHING, Level.VIEW)]
    different = {tuple(sorted(program.traits.items())): program for program in programs}
    validate(tmp_path, (program.source("300 es") for program in different.values()))


def values_of(program: str, generated: Mapping[str, str] | None = None) -> dict[str, list[int | str]]:
    """Every value of each feature of a program: names that are numbered right before it, or no and yes."""
    source = compose(program, {}, SHADERS, generated)
    values: dict[str, list[int | str]] = {}
    numbered: list[int | str] = []
    for line in source.text.splitlines():
        if found := re.match(r"#define (\w+) \d+(?: *//.*)?$", line):
            numbered.append(found[1])
        elif (feature := re.match(r"#ifndef (\w+)", line)) and feature[1] in source.features:
            values[feature[1]] = numbered or ([2, 9] if feature[1] == "BLOOM_RADIUS" else [0, 1])
            numbered = []
        else:
            numbered = []
    assert values.keys() == source.features.keys()
    for name, found in values.items():
        assert len(found) > 1
        assert source.features[name] in map(str, found)
    return values


def settings_of(values: Mapping[str, list[int | str]]) -> Iterator[dict[str, int | str]]:
    """The defaults, and each value of each feature with all others that are flags off or on."""
    yield {}
    for name, choices in values.items():
        flags = [other for other, found in values.items() if found == [0, 1]]
        yield from ({**dict.fromkeys(flags, flag), name: value} for value in choices for flag in (0, 1))


@pytest.mark.parametrize("language", LANGUAGES)
def test_other_programs_are_valid(tmp_path: Path, language: str) -> None:
    """Those that show the image, with each value of each of their features, maps, the film; vertex shaders."""
    shown = sorted(path.relative_to(SHADERS).as_posix() for path in SHADERS.glob("display/*.frag"))
    assert {"display/display.frag", "display/bloom.frag", "display/meter.frag"} <= set(shown)
    for program in shown:
        settings = settings_of(values_of(program))
        validate(tmp_path, (compose(program, s, SHADERS, language=language).text for s in settings))
    others = [
        path.relative_to(SHADERS).as_posix()
        for room in ("split_sum", "film")
        for path in SHADERS.glob(f"{room}/*.frag")
    ]
    assert len(others) > 1
    validate(tmp_path, [compose(path, {}, SHADERS, language=language).text for path in others])
    of_vertices = [path.relative_to(SHADERS).as_posix() for path in SHADERS.rglob("*.vert")]
    validate(tmp_path, [compose(path, {}, SHADERS, language=language).text for path in of_vertices], "vert")
    tops = {path.relative_to(SHADERS).as_posix() for path in SHADERS.rglob("*.frag")}
    assert tops == {*shown, *others, *PROGRAMS}, "some program is in no test"


def test_every_file_is_valid_by_itself(tmp_path: Path) -> None:
    """It includes all that it uses, with any value of each of its features: also where an include stands between
    conditions, which would be lost to a file that comes after. In GLSL ES; the tests above compile all in GLSL 3.30."""
    files = sorted(path.relative_to(SHADERS).as_posix() for path in SHADERS.rglob("*.glsl"))
    assert len(files) > 40
    validate(tmp_path, (source for path in files for source in alone(path, "300 es")))


def alone(path: str, language: str) -> Iterator[str]:
    """Programs of one file: with the defaults, with all that can be switched on, and with each value of the others."""
    body = "layout(location = 0) out vec4 color;\nvoid main() { color = vec4(0.0); }"
    generated = {"main.frag": f'#include "{path}"\n{body}'}
    values = values_of("main.frag", generated)
    settings: list[dict[str, int | str]] = [{}, {name: 1 for name, found in values.items() if found == [0, 1]}]
    settings += [{name: value} for name, found in values.items() if found != [0, 1] for value in found]
    for defines in settings:
        yield compose("main.frag", defines, SHADERS, generated, language).text


@pytest.mark.skipif(shutil.which("glslangValidator") is None, reason="glslangValidator is not installed")
@pytest.mark.parametrize(
    ("file", "text"),
    [
        (
            "sampler/sampler.glsl",
            '#include "core/hash.glsl"\n#include "core/texels.glsl"\n#include "sampler/roulette.glsl"\n',
        ),
        ("bsdf/ggx.glsl", '#include "core/math.glsl"\n'),
        ("light/light.glsl", '#include "light/spot.glsl"\n'),
    ],
)
def test_an_include_left_out_is_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, file: str, text: str) -> None:
    """The first is one that only the hash sampler misses, whose own includes stand behind those of the other one."""
    copy = tmp_path / "shaders"
    shutil.copytree(SHADERS, copy)
    source = (copy / file).read_text("utf-8")
    assert source.count(text) == 1
    (copy / file).write_text(source.replace(text, ""), "utf-8")
    monkeypatch.setattr(sys.modules[__name__], "SHADERS", copy)
    with pytest.raises((AssertionError, ShaderError), match=r"ERROR|unknown define"):
        validate(tmp_path, alone(file, "330 core"))


@pytest.mark.parametrize("program", PROGRAMS)
def test_every_feature_takes_part(program: str) -> None:
    """One that no test program ever changes would be one that nobody compiles."""
    found: dict[str, set[str]] = {name: set() for name in features_of(program)}
    for each in covering_programs(300, 2):
        if each.name == program:
            for name, value in {**features_of(program), **each.defines}.items():
                found[name].add(str(value))
    for name, values in values_of(program).items():
        numbers = {str(value) if isinstance(value, int) else value for value in values}
        by_number = {str(i): value for i, value in enumerate(values, start=name == "SPLIT_SUM_STEP")}
        never = numbers - {by_number.get(value, value) if values != [0, 1] else value for value in found[name]}
        # Karis's k of the environment is for the study of split-sum alone.
        assert never <= {"GEOMETRY_KARIS_ENVIRONMENT"}, name


@pytest.mark.skipif(shutil.which("glslangValidator") is None, reason="glslangValidator is not installed")
def test_wrong_programs_are_found_out(tmp_path: Path) -> None:
    """What GLSL ES lacks, what is misspelt, and what only some drivers let pass."""
    for line in ("float x = 1;", "uniform samplerBuffer u_b;", "float x = sine(1.0);", "float x = 1.0f + 1;"):
        with pytest.raises(AssertionError, match="ERROR"):
            validate(tmp_path, [LANGUAGES["300 es"] + f"precision highp float;\n{line}\nvoid main() {{}}"])
