# SPDX-License-Identifier: MIT
"""A file imports, or includes, only from layers below its own."""

import ast
import re
from collections.abc import Iterator, Sequence
from itertools import pairwise
from pathlib import Path

import pytest

import fragtracer
from fragtracer.shader_composer import compose

CHECKOUT = Path(__file__).parents[1]
SOURCE = CHECKOUT / "src" / "fragtracer"
SHADERS = CHECKOUT / "shaders"

# Bottom first, with the layer's number in the design notes. A row may use the rows above it in this
# table, and a package itself; modules of one row do not know each other.
LAYERS = [
    {"errors"},  # 0
    {"resources", "output", "display", "interruption"},  # 0
    {"cache"},  # 0
    {"scene", "bvh", "sampling", "aov"},  # 1
    {"shader_composer", "archive", "arguments", "denoising", "camera_path", "shutter"},  # 2
    {"films"},  # 3
    {"io", "packing"},  # 3
    {"gpu"},  # 4
    {"guiding", "layers", "moments", "probe"},  # 4
    {"light_tracing"},  # 4
    {"decisions"},  # 4
    {"renderer", "reference"},  # 5
    {"apps.compare"},  # 6
    {"apps.bench", "apps.cluster", "apps.doctor", "apps.viewer", "apps.web"},  # 6
    {"__init__"},  # the public face, which imports lazily from anywhere; all may ask it for the version
    {"apps.cli"},  # 6
    {"__main__"},  # 6
]
FACE = "__init__"
ONLY_IN = {"moderngl": ["gpu"], "glcontext": ["gpu"], "drjit": ["reference"]}
ONLY_IN |= {"mitsuba": ["reference", "io"]}  # the pictures of its scenes, and their files

# Bottom first; programs, which lie in none, may use all of them.
SHADER_FOLDERS = ["core", "sampler", "film", "bsdf", "scene", "texture", "shape", "medium", "camera", "material"]
SHADER_FOLDERS += ["light", "guiding", "integrator", "split_sum", "display"]
PROGRAM = "pathtracer.frag"  # which lists the whole architecture

RANK = {name: rank for rank, names in enumerate(LAYERS) for name in names}


def python_violations(path: str, text: str) -> Iterator[str]:
    """What is wrong with the imports of the module at ``path``, relative to ``src/fragtracer``."""
    own = _module(Path(path).with_suffix("").parts)
    if own == "apps.__init__":
        return
    if own not in RANK:
        yield f"{path} has no layer yet: place {own!r} in LAYERS"
        return
    for line, target in _imports(ast.parse(text), Path(path).parent.parts):
        where = f"{path}:{line} imports {target}"
        root, *inner = target.split(".")
        if own.split(".")[0] not in (allowed := ONLY_IN.get(root, own)):
            yield f"{where}, which belongs in {' and '.join(f'{name}/' for name in allowed)} alone"
        if root != "fragtracer" or own == FACE or _module(inner) in (own, "__version__"):
            continue
        other = _module(inner) if _module(inner) in RANK else FACE
        if RANK[other] >= RANK[own]:
            yield f"{where} ({other}), which is not below {own}"
        elif any(name.startswith("_") for name in inner):
            yield f"{where}, which is private"


def _module(parts: Sequence[str]) -> str:
    """What of LAYERS a dotted name lies in: its first part, and of apps the second too."""
    return ".".join(parts[: 2 if parts[:1] in (["apps"], ("apps",)) else 1])


def _imports(tree: ast.AST, package: tuple[str, ...]) -> Iterator[tuple[int, str]]:
    """Line and full dotted name of all that is imported, at the top or inside a function."""
    for node in ast.walk(tree):
        match node:
            case ast.Import():
                yield from ((node.lineno, alias.name) for alias in node.names)
            case ast.ImportFrom():
                above = ["fragtracer", *package][: len(package) + 2 - node.level] if node.level else []
                module = [node.module] if node.module else []
                yield from ((node.lineno, ".".join([*above, *module, alias.name])) for alias in node.names)
            case ast.Call(
                func=ast.Name(id="import_module" | "__import__") | ast.Attribute(attr="import_module"),
                args=[ast.Constant(value=str(target)), *_],
            ):
                yield node.lineno, target


def shader_violations(path: str, text: str) -> Iterator[str]:
    """What is wrong with the includes of the shader at ``path``, relative to ``shaders``."""
    folder = Path(path).parent.as_posix()
    if folder != "." and folder not in SHADER_FOLDERS:
        yield f"{path} is in a folder without a place: add {folder!r} to SHADER_FOLDERS"
        return
    rank = SHADER_FOLDERS.index(folder) if folder != "." else len(SHADER_FOLDERS)
    for line, target in _includes(text):
        where = f"{path}:{line} includes {target}"
        other = Path(target).parent.as_posix()
        if other not in SHADER_FOLDERS:
            yield f"{where}, which is in no folder of SHADER_FOLDERS"
        elif SHADER_FOLDERS.index(other) > rank:
            yield f"{where}, which is not below {folder}"


def _includes(text: str) -> Iterator[tuple[int, str]]:
    for line, code in enumerate(text.splitlines(), start=1):
        if found := re.match(r'\s*#\s*include\s*[<"](.+?)[>"]', code):
            yield line, found[1]


def _files(root: Path, *suffixes: str) -> list[str]:
    found = sorted(p.relative_to(root).as_posix() for p in root.rglob("*") if p.suffix in suffixes)
    assert found, f"nothing to check in {root}"
    return found


def test_python_imports_go_down() -> None:
    wrong = [w for path in _files(SOURCE, ".py") for w in python_violations(path, (SOURCE / path).read_text())]
    assert not wrong, "\n".join(wrong)


def test_shader_includes_go_down() -> None:
    files = _files(SHADERS, ".glsl", ".frag", ".vert")
    wrong = [w for path in files for w in shader_violations(path, (SHADERS / path).read_text())]
    assert not wrong, "\n".join(wrong)


def test_program_lists_its_folders_from_the_bottom() -> None:
    folders = [Path(target).parent.name for _, target in _includes((SHADERS / PROGRAM).read_text())]
    ranks = [SHADER_FOLDERS.index(folder) for folder in folders]
    assert all(a <= b for a, b in pairwise(ranks)), folders
    reached = {Path(place).parent.as_posix() for place in compose(PROGRAM, {}, SHADERS).lines}
    assert set(folders) == reached & set(SHADER_FOLDERS), "the list leaves a folder out"


def test_files_do_not_include_each_other() -> None:
    """Nor does a folder use another that uses it, which test_shader_includes_go_down already says."""
    for path in _files(SHADERS, ".glsl", ".frag"):
        compose(path, {}, SHADERS)  # raises for a cycle


@pytest.mark.parametrize(
    ("path", "text"),
    [
        ("scene/camera.py", "from fragtracer.renderer import render"),
        ("scene/camera.py", "def f():\n    from fragtracer.gpu import film"),
        ("scene/camera.py", "import fragtracer.gpu.film"),
        ("scene/camera.py", "from fragtracer import packing"),
        ("scene/camera.py", "from fragtracer import load"),
        ("scene/camera.py", "import fragtracer"),
        ("scene/camera.py", "from .. import packing"),
        ("scene/camera.py", "from ..packing import pack"),
        ("gpu/film.py", "from ..renderer import render"),
        ("gpu/film.py", "from fragtracer.scene import _as_unit"),
        ("packing.py", "from fragtracer import io"),
        ("reference/build.py", "from fragtracer.renderer import render"),
        ("renderer.py", "import moderngl"),
        ("renderer.py", "import moderngl.error"),
        ("apps/compare/report.py", "from mitsuba import render"),
        ("apps/compare/report.py", "import importlib\nimportlib.import_module('mitsuba')"),
        ("apps/bench/speed.py", "import fragtracer as ft"),
        ("unheard_of.py", ""),
    ],
)
def test_wrong_import_is_found(path: str, text: str) -> None:
    assert list(python_violations(path, text))


@pytest.mark.parametrize(
    ("path", "text"),
    [
        ("gpu/film.py", "import moderngl\nfrom fragtracer.gpu.program import _link\nfrom . import program"),
        ("gpu/film.py", "from ..scene import Scene\nfrom fragtracer import scene, __version__"),
        ("renderer.py", "from fragtracer import __version__"),
        ("reference/build.py", "import drjit as dr, mitsuba as mi, numpy\nfrom fragtracer.scene import Scene"),
        ("__init__.py", "from fragtracer.renderer import render"),
        ("apps/cli/info.py", "import fragtracer"),
    ],
)
def test_right_import_passes(path: str, text: str) -> None:
    assert not list(python_violations(path, text))


@pytest.mark.parametrize(
    ("path", "text"),
    [
        ("bsdf/ggx.glsl", '#include "shape/ray.glsl"'),
        ("core/math.glsl", '  # include "film/film.glsl"'),
        ("scene/light.glsl", '#include "light/light.glsl"'),
        ("integrator/path.glsl", '#include "split_sum/shading.glsl"'),
        ("shape/ray.glsl", '#include "volume/fog.glsl"'),
        ("volume/fog.glsl", ""),
    ],
)
def test_wrong_include_is_found(path: str, text: str) -> None:
    assert list(shader_violations(path, text))


def test_no_module_has_the_name_of_something_offered():
    """Importing it would put the module in the place of that."""
    modules = {path.stem for path in SOURCE.iterdir()}
    assert modules.isdisjoint(fragtracer.__all__)
