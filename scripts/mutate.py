# SPDX-License-Identifier: MIT
"""Plants random errors in the shaders, one at a time, and says which of them no test finds.

usage: python scripts/mutate.py [--count 200] [--seed 1] [--jobs N] [--kept fates.jsonl] [--output survivors.md]

The errors: another operator, a factor dropped, a constant 1 % larger, another sign, min for max, a whole number one
larger. Each is planted in a copy of the checkout, where the tests of its folder run up to the first that fails; those
that are left are planted again, for the tests of the whole picture, which take half an hour. A program that
glslangValidator rejects is no error that anyone would miss, and another is drawn for it. The same seed draws the same
errors from the same shaders, and --kept does not plant again what an earlier call has judged.

A survivor is either an error for which a test is missing, or one that changes nothing: read it, and write the test, or
write "changes nothing: ..." as its fate into the file of --kept.
"""

import argparse
import json
import os
import random
import re
import shutil
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import chain, islice
from pathlib import Path
from queue import Queue

from fragtracer.shader_composer import compose

CHECKOUT = Path(__file__).resolve().parents[1]
LEFT_OUT = (".git", ".venv", "__pycache__", ".*_cache", "node_modules", "out", "site", "dist", "build")

# The tests of what a folder of shaders, or a program, holds, the quickest first.
OWN = {
    "auxiliary.frag": ("apps/viewer/test_display.py", "apps/viewer/test_session.py", "test_split_sum.py",
                       "apps/viewer/test_viewer.py"),
    "bsdf": ("shaders/test_fresnel.py", "shaders/test_ggx.py", "shaders/test_bsdf_values.py", "shaders/test_coats.py",
             "test_textured.py", "shaders/test_bsdf_sample.py", "test_dielectrics.py"),
    "camera": ("shaders/test_camera.py",),
    "core": ("shaders/test_math.py", "shaders/test_hash.py", "shaders/test_warp.py", "test_cube_maps.py"),
    "display": ("apps/viewer/test_display.py",),
    "film": ("shaders/test_film.py", "shaders/test_pixel_filter.py", "test_adaptive_sampling.py", "test_aov.py"),
    "guiding": ("shaders/test_guiding.py", "test_guiding.py"),
    "integrator": ("test_furnace.py", "test_direct_light.py", "test_dielectrics.py", "test_media.py",
                   "test_split_sum.py", "test_environment_light.py", "test_anisotropy.py"),
    "light_tracing.frag": ("test_light_tracing.py", "test_photon_sums.py"),
    "layers.frag": ("test_aov.py", "test_denoise.py"),
    "light": ("shaders/test_sphere_light.py", "shaders/test_environment.py", "shaders/test_mesh_light.py",
              "shaders/test_light.py", "shaders/test_light_choice.py", "test_split_sum.py"),
    "material": ("shaders/test_material.py", "test_textured.py", "test_anisotropy.py"),
    "medium": ("shaders/test_medium.py", "test_media.py"),
    "photons.frag": ("test_guiding.py",),
    "sampler": ("shaders/test_sampler.py", "test_convergence.py"),
    "scene": ("shaders/test_scene_layout.py", "shaders/test_material.py", "shaders/test_texture.py",
              "shaders/test_mesh.py", "shaders/test_light.py", "shaders/test_light_choice.py"),
    "shape": ("shaders/test_shapes.py", "shaders/test_intersect.py", "shaders/test_mesh.py"),
    "split_sum": ("test_cube_maps.py",),
    "split_sum.frag": ("test_split_sum.py",),
    "texture": ("shaders/test_texture.py", "test_cube_maps.py"),
}  # fmt: skip
# Then those of the whole picture.
ALL = ("test_furnace.py", "test_direct_light.py", "test_estimators.py", "test_textured.py", "test_robustness.py",
       "test_same_picture.py", "test_split_sum.py", "test_dielectrics.py", "test_media.py", "test_guiding.py",
       "test_light_tracing.py", "test_light_tracing_decisions.py", "test_photon_sums.py",
       "test_adaptive_sampling.py", "test_gradient_domain.py", "test_aov.py", "test_convergence.py", "shaders",
       "studio.py::comparison_with_mitsuba", "apps/viewer/test_display.py", "test_reference_scenes.py",
       "test_reference_meshes.py")  # fmt: skip

_NUMBER = r"(?<![\w.])(?:\d+\.\d*(?:e-?\d+)?|\d*\.\d+(?:e-?\d+)?)(?![\w.])"
_OPERAND = r"(?:\w+(?:\.\w+)?(?:\([^()]*\))?)"
_OTHER_OPERATOR = {"+": "-", "-": "+", "*": "/", "/": "*", "<": "<=", "<=": "<", ">": ">=", ">=": ">"}
_OTHER_OPERATOR |= {"&&": "||", "||": "&&", "==": "!=", "!=": "=="}
# Of each kind of error: what it replaces, and by what.
KINDS: dict[str, tuple[str, Callable[[str], str]]] = {
    "operator": (r"(?<= )(?:[-+*/<>]|<=|>=|&&|\|\||==|!=)(?= )", _OTHER_OPERATOR.__getitem__),
    "factor dropped": (rf" \* {_OPERAND}(?=[;,) ])", lambda text: ""),
    "constant 1 % larger": (_NUMBER, lambda text: f"{1.01 * float(text):.9g}" if float(text) else "0.01"),
    "sign": (
        rf"(?<=[(=,?:] )-(?={_OPERAND})|(?<=\()-(?={_OPERAND})|(?<=return )(?=\w)",
        lambda text: "" if text else "-",
    ),
    "min for max": (r"\b(?:min|max)(?=\()", lambda text: "max" if text == "min" else "min"),
    "off by one": (r"(?<![\w.])(?<!e-)\d+(?=u?(?![\w.]))", lambda text: str(int(text) + 1)),
}


@dataclass(frozen=True)
class Error:
    """One place in a file, and what is planted there."""

    file: str
    line: int
    kind: str
    before: str
    after: str

    def plant(self, shaders: Path) -> None:
        path = shaders / self.file
        lines = path.read_text("utf-8").splitlines(keepends=True)
        assert lines[self.line - 1].rstrip("\n") == self.before
        lines[self.line - 1] = self.after + "\n"
        path.write_text("".join(lines), "utf-8")

    def __str__(self) -> str:
        return f"{self.file}:{self.line}, {self.kind}\n    - {self.before.strip()}\n    + {self.after.strip()}"


def errors_of(file: str, text: str) -> Iterator[Error]:
    """All that may be planted in a file, from its first line to its last."""
    for number, line in enumerate(text.splitlines(), 1):
        code = line.split("//")[0]
        if not code.strip() or re.match(r"\s*(#|uniform\b|layout\b|out\b|in\b)", code):
            continue
        for kind, (pattern, other) in KINDS.items():
            for match in re.finditer(pattern, code):
                changed = line[: match.start()] + other(match[0]) + line[match.end() :]
                yield Error(file, number, kind, line, changed)


def drawn(seed: int) -> Iterator[Error]:
    """Errors without end: a file, a kind of error and a place in it, all by chance; none comes twice."""
    rng = random.Random(seed)
    shaders = CHECKOUT / "shaders"
    paths = sorted(path for suffix in ("glsl", "frag") for path in shaders.rglob(f"*.{suffix}"))
    places: dict[str, dict[str, list[Error]]] = {}
    for path in paths:
        name = path.relative_to(shaders).as_posix()
        for error in errors_of(name, path.read_text("utf-8")):
            places.setdefault(name, {}).setdefault(error.kind, []).append(error)
    while places:
        name = rng.choice(sorted(places))
        kind = rng.choice(sorted(places[name]))
        errors = places[name][kind]
        yield errors.pop(rng.randrange(len(errors)))
        if not errors:
            del places[name][kind]
        if not places[name]:
            del places[name]


class Copy:
    """A checkout of its own, in which errors come and go."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        shutil.copytree(CHECKOUT, folder, ignore=shutil.ignore_patterns(*LEFT_OUT), dirs_exist_ok=True)
        self._environment = os.environ | {"PYTHONPATH": str(folder / "src")}

    def fate(self, error: Error, is_whole: bool) -> str:
        """The test that finds an error, of its folder or of the whole picture; "invalid" where no program with it
        compiles, "" where none finds it."""
        shaders = self._folder / "shaders"
        original = (shaders / error.file).read_text("utf-8")
        error.plant(shaders)
        self._environment["FRAGTRACER_CACHE"] = tempfile.mkdtemp(dir=self._folder)
        try:
            if not is_valid(shaders, error.file):
                return "invalid"
            own = OWN.get(error.file.split("/")[0], ())
            return self.failure([name for name in ALL if name not in own] if is_whole else own)
        finally:
            (shaders / error.file).write_text(original, "utf-8")

    def failure(self, tests: Sequence[str]) -> str:
        """The first of the tests that fails, "" where there is none."""
        if not tests:
            return ""
        command = [sys.executable, "-m", "pytest", "-x", "-q", "-n", "0", "-p", "no:cacheprovider", "--tb=no"]
        command += ["-o", "python_functions=test comparison_with_mitsuba", *(f"tests/{test}" for test in tests)]
        done = subprocess.run(
            command, cwd=self._folder, env=self._environment, capture_output=True, text=True, check=False
        )
        if done.returncode == 0:
            return ""
        found = re.search(r"^(?:FAILED|ERROR) (\S+)", done.stdout, re.MULTILINE)
        return found[1] if found else done.stdout.strip()[-200:] or done.stderr.strip()[-200:]


def is_valid(shaders: Path, file: str) -> bool:
    """Whether a program of a file compiles, with the defaults and with all that can be switched on."""
    name = file if file.endswith(".frag") else "main.frag"
    main = f'#include "{file}"\nlayout(location = 0) out vec4 color;\nvoid main() {{ color = vec4(0.0); }}'
    composed = [compose(name, {}, shaders, {"main.frag": main})]
    flags = {key: 1 for key, value in composed[0].features.items() if value in ("0", "1")}
    composed.append(compose(name, flags, shaders, {"main.frag": main}))
    with tempfile.TemporaryDirectory() as folder:
        paths = [Path(folder) / f"{number}.frag" for number in range(len(composed))]
        for path, source in zip(paths, composed, strict=True):
            path.write_text(source.text, "utf-8")
        return subprocess.run(["glslangValidator", *paths], capture_output=True, check=False).returncode == 0


class Judgements:
    """What was judged of errors, one to a line of a file, if there is one."""

    def __init__(self, path: Path | None) -> None:
        self._path = path
        lines = path.read_text("utf-8").splitlines() if path and path.is_file() else []
        self._fates = {(str(j["error"]), bool(j.get("whole", True))): str(j["fate"]) for j in map(json.loads, lines)}

    def of(self, error: Error, is_whole: bool) -> str | None:
        """The fate of an error by the tests of its folder or of the whole picture, None where that is not known."""
        fate = self._fates.get((str(error), is_whole))
        return fate if is_whole or fate is not None else self._fates.get((str(error), True))

    def keep(self, error: Error, fate: str, is_whole: bool) -> None:
        self._fates[str(error), is_whole] = fate
        if self._path:
            with self._path.open("a", encoding="utf-8") as file:
                file.write(json.dumps({"error": str(error), "fate": fate, "whole": is_whole}) + "\n")


def main() -> None:
    parser = argparse.ArgumentParser(description=str(__doc__).splitlines()[0])
    parser.add_argument("--count", type=int, default=200, help="errors that compile")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--kept", type=Path, help="a file of what was judged, added to and not judged again")
    parser.add_argument("--output", type=Path, help="a file for the survivors")
    options = parser.parse_args()
    judgements = Judgements(options.kept)
    with tempfile.TemporaryDirectory(prefix="fragtracer-mutate-") as folder:
        copies: Queue[Copy] = Queue()
        for number in range(options.jobs):
            copies.put(Copy(Path(folder) / str(number)))

        # A test that fails without an error finds none.
        if fails := copies.queue[0].failure(list(dict.fromkeys([*chain(*OWN.values()), *ALL]))):
            sys.exit(f"{fails} fails without an error: mend it first")

        def judged(error: Error, is_whole: bool) -> str:
            fate = judgements.of(error, is_whole)
            if fate is None:
                copy = copies.get()
                try:
                    fate = copy.fate(error, is_whole)
                finally:
                    copies.put(copy)
                judgements.keep(error, fate, is_whole)
                print(f"{fate or ('SURVIVES' if is_whole else 'no test of its folder'):60}  {error}", flush=True)
            return fate

        errors, valid = drawn(options.seed), dict[Error, str]()
        with ThreadPoolExecutor(options.jobs) as pool:
            while len(valid) < options.count:
                some = list(islice(errors, options.count - len(valid)))
                for error, fate in zip(some, pool.map(lambda error: judged(error, False), some), strict=True):
                    if fate != "invalid":
                        valid[error] = fate
            left = [error for error, fate in valid.items() if not fate]
            valid |= zip(left, pool.map(lambda error: judged(error, True), left), strict=True)
    fates = list(valid.items())
    report = "\n".join(summary(fates, options.seed))
    print(report)
    if options.output:
        options.output.write_text(report + "\n", "utf-8")


def summary(fates: Sequence[tuple[Error, str]], seed: int) -> Iterator[str]:
    """How many survive, of each kind, and which."""
    survivors = [error for error, fate in fates if not fate]
    harmless = sum(fate.startswith("changes nothing") for _, fate in fates)
    yield f"{len(survivors)} of {len(fates)} errors survive ({100 * len(survivors) / len(fates):.1f} %), seed {seed}."
    yield f"{harmless} change nothing."
    planted, left = (Counter(error.kind for error in errors) for errors in ([e for e, _ in fates], survivors))
    yield from (f"{kind}: {left[kind]} of {planted[kind]}" for kind in KINDS)
    yield from map(str, survivors)


if __name__ == "__main__":
    main()
