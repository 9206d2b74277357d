# SPDX-License-Identifier: MIT
"""The conventions of shaders/: names, and a density for every sampler."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from fragtracer.resources import folder

SHADERS = folder("shaders")
FILES = sorted(p.relative_to(SHADERS).as_posix() for p in SHADERS.rglob("*") if p.suffix in (".glsl", ".frag", ".vert"))

FUNCTION = re.compile(r"^(?:highp\s+)?(\w+)\s+(\w+)\([^()]*\)\s*\{", re.MULTILINE)
IMAGE = re.compile(r"^(?:U?TEXELS(?:_3D)?|OUTPUT)\((\d+)\) (\w+);", re.MULTILINE)  # of core/texels.glsl
NAME_OF_FILE = re.compile(r"\.(?:glsl|frag|vert)\b")
CHOICE = re.compile(r"mix\(.*\b(?:float|vec\d)\((?:is_|has_|lessThan|greaterThan|equal|notEqual|not\b)")
SNAKE_CASE = re.compile(r"[a-z][a-z0-9]*(_[a-z0-9]+)*")
PASCAL_CASE = re.compile(r"([A-Z][a-z0-9]+)+")

# A function begins with the name of its file or folder, of a struct that the file declares, or with one of these.
NOUNS = {
    "core/math.glsl": None,  # helpers without a noun
    "core/warp.glsl": {"square_to"},
    "sampler/sampler.glsl": {"dimension"},
    "scene/texture.glsl": {"textures"},
    "scene/vertex.glsl": {"vertices"},
    "scene/storage.glsl": {"shape", "vertex"},
    "shape/bvh.glsl": {"node"},
    "shape/intersect.glsl": {"scene"},
    "shape/ray.glsl": {"bvh"},
    "shape/shape.glsl": {"hit", "surface"},
    "shape/surface.glsl": {"unit"},
    "material/visibility.glsl": {"alpha", "closest"},
    "bsdf/shading_normal.glsl": {"shadow"},
    "integrator/escape.glsl": {"escaped"},
    "integrator/split_sum_study.glsl": {"split_sum"},
    "display/tone.glsl": {"srgb"},
    "display/picture.glsl": None,  # what each step from the film to the window does
}
# Samplers whose density no estimator asks for.
WITHOUT_PDF = {
    "split_sum_step_sample": "the density comes with the integrand, from split_sum_kernel_pdf",
    "pixel_filter_sample": "the density is the filter itself, so every sample has the same weight",
    "direct_sample": "the radiance of one, divided by its density",
    "direct_ambient_sample": "the radiance of one, divided by its density",
    "sampler_rr_sample": "a uniform number",
    "bsdf_no_sample": "none is drawn",
    "light_no_sample": "none is drawn",
    "facets_sample_vndf": "what is asked for is the density of the direction that a facet sends light to",
    "flat_sample": "uniform in its coordinates, so that the density is 1 over the area",
    "medium_sample": "the weight is over the mean density of the channels",
    "phase_sample": "the density is the phase function itself, phase_eval",
    "environment_light_sample": "the density comes with the radiance, from environment_radiance_pdf",
}


def functions(text: str) -> list[str]:
    return [name for kind, name in FUNCTION.findall(text) if kind not in ("else", "return")]


def misnamed(path: str, text: str) -> Iterator[str]:
    """What in a file is not called as it should be."""
    nouns = NOUNS.get(path, set())
    stem, parent = Path(path).stem, Path(path).parent.name
    structs = {
        re.sub(r"(?<!^)([A-Z])", r"_\1", name).lower() for name in re.findall(r"^struct (\w+)", text, re.MULTILINE)
    }
    for name in functions(text):
        if not SNAKE_CASE.fullmatch(name):
            yield f"{path}: function {name} is not in snake_case"
        is_library = path.endswith(".glsl") and nouns is not None and not name.startswith("is_")
        if is_library and not any(name.startswith(f"{noun}_") for noun in {stem, parent, *structs, *nouns}):
            yield f"{path}: function {name} begins with neither {stem} nor {parent}"
    for name in re.findall(r"^\s*struct\s+(\w+)", text, re.MULTILINE):
        if not PASCAL_CASE.fullmatch(name):
            yield f"{path}: struct {name} is not in PascalCase"
    uniforms = re.findall(r"^\s*uniform\s+(highp\s+)?(\w+)\s+(\w+)", text, re.MULTILINE)
    uniforms += [("highp", "table", name) for _, name in IMAGE.findall(text) if not name.startswith("out_")]
    for qualifier, kind, name in uniforms:
        if not re.fullmatch(f"u_{SNAKE_CASE.pattern}", name):
            yield f"{path}: uniform {name} does not begin with u_"
        if "sampler" in kind and not qualifier:
            yield f"{path}: sampler {name} has no explicit precision"
    for name in re.findall(
        r"^\s*(?:(?:layout\s*\([^)]*\)\s*)?out\s+\w+|OUTPUT\(\d+\))\s+(\w+)\s*;", text, re.MULTILINE
    ):
        if not re.fullmatch(f"out_{SNAKE_CASE.pattern}", name):
            yield f"{path}: output {name} does not begin with out_"
    for name in re.findall(r"^\s*const\s+\w+\s+(\w+)", re.sub(r"^ .*", "", text, flags=re.MULTILINE), re.MULTILINE):
        if not re.fullmatch(r"[A-Z][A-Z0-9_]*", name):
            yield f"{path}: constant {name} is not in capitals"


def unpaired(names: list[str]) -> list[str]:
    """Samplers and maps without a density."""
    samplers = [n for n in names if re.search(r"_sample($|_(?!index))|^square_to_", n) and not n.endswith("_pdf")]
    known, exempt = set(names), set(WITHOUT_PDF) | delta_lights()
    return [n for n in samplers if n not in exempt and not densities(n) & known]


def delta_lights() -> set[str]:
    """The samplers of lights that no ray can meet."""
    text = "".join(path.read_text() for path in sorted(SHADERS.glob("light/*.glsl")))
    samplers = re.findall(r"^LightSample (\w+_light_sample)(\(.*?)^\}", text, re.MULTILINE | re.DOTALL)
    return {name for name, body in samplers if ", 1.0, true, NO_PRIMITIVE);" in body}


def densities(name: str) -> set[str]:
    """bsdf_sample has bsdf_pdf, or bsdf_eval_pdf with the value; ggx_sample_vndf has ggx_sample_vndf_pdf."""
    noun = name.removesuffix("_sample")
    return {f"{name}_pdf", f"{noun}_pdf", f"{noun}_eval_pdf"}


@pytest.mark.parametrize("path", FILES)
def test_names(path: str) -> None:
    text = (SHADERS / path).read_text()
    assert text.startswith("// SPDX-License-Identifier: MIT\n")
    assert not list(misnamed(path, text))


@pytest.mark.parametrize("path", FILES)
def test_values_are_chosen_by_booleans(path: str) -> None:
    """A driver may compute mix(a, b, 1.0) as a + (b - a), which is not b where a is large."""
    assert not CHOICE.search((SHADERS / path).read_text())


def test_choice_by_a_number_is_found() -> None:
    assert CHOICE.search("    x = mix(large / max(tiny, 1e-30), small, vec2(is_small));")


def test_every_image_has_its_unit() -> None:
    """Outputs of the programs count from 0, at most 8 of them; each table has a unit of its own after these."""
    units: dict[str, list[int]] = {}
    for path in FILES:
        for unit, name in IMAGE.findall((SHADERS / path).read_text()):
            units.setdefault(path if name.startswith("out_") else "tables", []).append(int(unit))
    tables = units.pop("tables")
    assert sorted(tables) == list(range(8, 8 + len(tables)))
    assert len(units) > 5
    assert all(found == list(range(len(found))) and len(found) <= 8 for found in units.values())


def test_every_sampler_has_its_density() -> None:
    names = [name for path in FILES for name in functions((SHADERS / path).read_text())]
    assert {"bsdf_sample", "light_sample", "square_to_triangle", "ggx_sample_vndf", "area_light_sample"} <= set(names)
    assert not unpaired(names)
    assert set(WITHOUT_PDF) <= set(names)


@pytest.mark.parametrize(
    ("path", "text"),
    [
        ("bsdf/ggx.glsl", "float ggxD(float x) {"),
        ("bsdf/ggx.glsl", "float beckmann_d(float x) {"),
        ("light/spot.glsl", "struct SpotLight { float x; };\nSpotLight point_light_of(uvec4 t0) {"),
        ("shape/cone.glsl", "struct cone_hit { float t; };"),
        ("film/film.glsl", "uniform vec3 color;"),
        ("film/film.glsl", "uniform sampler2D u_image;"),
        ("display/display.frag", "layout(location = 1) out vec4 color;"),
        ("pathtracer.frag", "OUTPUT(0) mean;"),
        ("scene/storage.glsl", "UTEXELS(9) scene;"),
        ("core/constants.glsl", "const float Pi = 3.0;"),
    ],
)
def test_wrong_name_is_found(path: str, text: str) -> None:
    assert list(misnamed(path, text))


@pytest.mark.parametrize("names", [["cone_sample"], ["cone_sample_rim", "cone_pdf"], ["square_to_cone"]])
def test_sampler_without_density_is_found(names: list[str]) -> None:
    assert unpaired(names)


def test_sampler_with_density_passes() -> None:
    assert not unpaired(["cone_sample", "cone_pdf", "square_to_cone", "square_to_cone_pdf", "film_sampler_index"])
    assert not unpaired(["cone_sample", "cone_eval_pdf"])


def planted() -> Iterator[tuple[str, str]]:
    """The file and the text that each literal planted error of the tests replaces."""
    for path in sorted(Path(__file__).parents[1].rglob("*.py")):
        source = path.read_text("utf-8")
        if not NAME_OF_FILE.search(source):
            continue
        for node in ast.walk(ast.parse(source)):
            values = node.elts if isinstance(node, ast.Tuple) else node.args if isinstance(node, ast.Call) else []
            texts = [value.value if isinstance(value, ast.Constant) else None for value in values]
            for file, text, replacement in zip(texts, texts[1:], texts[2:], strict=False):
                if file in FILES and isinstance(text, str) and isinstance(replacement, str):
                    yield file, text


def test_the_text_of_every_planted_error_is_there():
    errors = list(planted())
    assert len(errors) > 150
    assert [error for error in errors if (SHADERS / error[0]).read_text("utf-8").count(error[1]) != 1] == []
