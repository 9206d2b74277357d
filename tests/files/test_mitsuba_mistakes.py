# SPDX-License-Identifier: MIT
"""What Mitsuba's scene files have that we cannot show, and mistakes in them."""

import re
from pathlib import Path

import numpy as np
import pytest

from fragtracer.errors import FragtracerError, SceneError
from fragtracer.io import AnimationError
from fragtracer.io.toml import load

from .mitsuba_files import SENSOR, bitmap, gray, notes, quietly, scene_file, torus, written

pytest.importorskip("mitsuba", reason="Mitsuba is not installed")
RNG = np.random.default_rng(7)
WRONG = ["", "-1", "0", "nan", "1e30", "inf", "x", "1, 2", "true", "99999999999999999999", "$q", "../.."]
BLUR = '<shape type="sphere"><bsdf type="{}">{}</bsdf></shape>'

NOTES = {
    "beckmann": (BLUR.format("roughconductor", ""), "line 6: Beckmann's facets of <bsdf type=.roughconductor.>, GGX's"),
    "bsdf": (BLUR.format("hair", ""), "line 6: <bsdf type=.hair.>, a diffuse grey"),
    "principled": (BLUR.format("principled", ""), "a metallic-roughness material in its place"),
    "key": (BLUR.format("diffuse", '<float name="shine" value="2"/>'), "shine of <bsdf"),
    "factor": (BLUR.format("plastic", '<float name="specular_reflectance" value="0.5"/>'), "specular_reflectance of"),
    "bumps": (BLUR.format("bumpmap", bitmap("", "grey.png") + gray("0.5")), "line 6: the bumps of a shape without"),
    "shape": ('<shape type="bsplinecurve"><string name="filename" value="x"/></shape>', "<shape type=.bsplinecurve.>"),
    "emitter": ('<emitter type="projector"/>', "line 6: <emitter type=.projector.>"),
    "sensor": (SENSOR, "another camera"),
    "spot": ('<emitter type="spot"/>', "the falloff of"),
}


@pytest.mark.parametrize(("body", "note"), NOTES.values(), ids=NOTES)
def test_what_is_not_as_in_mitsuba_is_said(tmp_path: Path, body: str, note: str) -> None:
    assert re.search(note, notes(tmp_path, body))


MISTAKES = {
    "no camera": ("", "", "there is no camera"),
    "no XML": ("<shape", SENSOR, "scene.xml: Parsing of XML file"),
    "no number": ('<shape type="sphere"><float name="radius" value="x"/></shape>', SENSOR, "could not parse floating"),
    "of another type": (
        '<shape type="sphere"><string name="radius" value="1"/></shape>',
        SENSOR,
        ':6: <shape type="sphere">: radius must be a number',
    ),
    "no radius": (
        '<shape type="sphere"><float name="radius" value="0"/></shape>',
        SENSOR,
        ':6: <shape type="sphere">: radius must be above 0, not 0',
    ),
    "no length": (
        '<shape type="cylinder"><point name="p0" x="0" y="0" z="1"/></shape>',
        SENSOR,
        "p0 and p1 must differ",
    ),
    "flattened": (
        '<shape type="disk"><transform name="to_world"><scale value="0"/></transform></shape>',
        SENSOR,
        "to_world flattens it; scale by numbers other than 0",
    ),
    "no file name": ('<shape type="obj"/>', SENSOR, ':6: <shape type="obj">: filename is missing'),
    "no file": ('<shape type="obj"><string name="filename" value="a.obj"/></shape>', SENSOR, "there is no file"),
    "instance of nothing": ('<shape type="instance"/>', SENSOR, "it names no <shape type="),
    "nothing to wrap": ('<shape type="sphere"><bsdf type="twosided"/></shape>', SENSOR, "it holds no other <bsdf>"),
    "two environments": ('<emitter type="constant"/>' * 2, SENSOR, "there is another environment"),
    "negative light": (
        '<emitter type="constant"><float name="radiance" value="-1"/></emitter>',
        SENSOR,
        "radiance must be greater than or equal to 0",
    ),
    "another camera": ("", SENSOR.replace("perspective", "orthographic"), "use perspective or thinlens"),
    "mirrored": ("", SENSOR.replace("<lookat", '<scale x="-1"/><lookat'), "mirrors or flattens the picture"),
    "reference to nothing": ('<ref id="x"/>', SENSOR, 'unresolved reference to "x"'),
    "unknown metal": (
        BLUR.format("conductor", '<string name="material" value="Xy"/>'),
        SENSOR,
        r':6: <bsdf type="conductor">: failed to instantiate .*Xy.eta.spd": file does not exist',
    ),
}


@pytest.mark.parametrize(("body", "head", "message"), MISTAKES.values(), ids=MISTAKES)
def test_mistakes(tmp_path: Path, body: str, head: str, message: str) -> None:
    """One error names the file, the line, the plugin and what is wrong."""
    with pytest.raises(SceneError, match=message) as error:
        load(written(tmp_path, body, head))
    assert str(error.value).startswith(str(tmp_path / "scene.xml"))
    assert "\n" not in str(error.value)


def test_a_file_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match=r"other.xml: no such file"):
        load(tmp_path / "other.xml")
    with pytest.raises(AnimationError, match="no animations"):
        load(written(tmp_path, '<shape type="sphere"/>'), animation="Run")


def test_without_mitsuba(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "mitsuba", None)
    with pytest.raises(SceneError, match=r"pip install 'fragtracer\[reference\]'"):
        load(written(tmp_path, '<shape type="sphere"/>'))


def test_damaged_files(tmp_path: Path) -> None:
    """Whatever is changed in a file, it is read, or refused by an error of ours."""
    texts = [scene_file(tmp_path, name).read_text() for name in ("surfaces", "shapes")]
    torus(tmp_path / "ring.obj", 4, 3)
    outcomes = [_outcome(tmp_path / "scene.xml", _damaged(texts[i % 2])) for i in range(120)]
    assert set(outcomes) == {"read", "refused"}


def _damaged(text: str) -> str:
    """With another value, type or name in one place."""
    kind = RNG.choice(["value", "type", "name"])
    found = list(re.finditer(rf'\b{kind}="([^"]*)"', text))
    place, other = (found[i] for i in RNG.integers(len(found), size=2))
    value = str(RNG.choice(WRONG)) if kind == "value" else other[1]
    return text[: place.start(1)] + value + text[place.end(1) :]


def _outcome(path: Path, text: str) -> str:
    path.write_text(text)
    try:
        quietly(path)
    except FragtracerError:
        return "refused"
    return "read"
