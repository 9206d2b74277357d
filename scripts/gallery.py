# SPDX-License-Identifier: MIT
"""Writes site/: the documentation, an API reference, all bundled scenes as live pages, and the method step by step.

python scripts/gallery.py [--time SECONDS] [SCENE ...]
"""

import argparse
import logging
import re
import shutil
from dataclasses import replace
from pathlib import Path

from mkdocs.commands.build import build
from mkdocs.config import load_config

import fragtracer as ft
from fragtracer.apps.web import Page, page
from fragtracer.io.toml import bundled
from fragtracer.scene import Scene

CHECKOUT = Path(__file__).parents[1]
PAGES = ("README.md", "CONTRIBUTING.md", "CHANGELOG.md", "scenes/README.md", "shaders/README.md")
METHOD = "docs/method.md"
WIDTH = 480  # of a poster
STEP_SIZE = (384, 216)  # of a picture of the method
STEP_SPP = 16
ONE_PAGE = "---\nhide: [navigation]\n---\n\n"  # nothing beside it in its part of the site
CSS = """
.md-grid { max-width: 70rem; }
.md-typeset pre > code { font-size: .62rem; }
.posters { display: grid; grid-template-columns: repeat(auto-fill, minmax(14rem, 1fr)); gap: 1rem; }
.posters img { width: 100%; border-radius: .3rem; }
.posters p { margin: 0; }
.live { display: flex; flex-wrap: wrap; gap: .5rem; }
.live iframe { flex: 1 1 13rem; height: 24rem; border: 1px solid var(--md-default-fg-color--lightest); }
"""
FENCE = re.compile(r"^```glsl\n(shaders/\S+): (.+)\n```$", re.MULTILINE)
LIVE = re.compile(r"^<!-- live: (.+) -->$", re.MULTILINE)
LINK = re.compile(r"\]\(([^)#:]+)(?:#[^)]*)?\)")


def steps() -> dict[str, Scene]:
    """The scenes of the method's live pictures."""
    spheres, box = ft.load("three-spheres"), ft.load("cornell-box")
    flat = replace(spheres, materials={name: replace(m, unlit=True) for name, m in spheres.materials.items()})
    gold = replace(spheres.materials["gold"], roughness=0.12)
    light = replace(spheres.lights[0], radius=1.0)
    polished = replace(spheres, materials={**spheres.materials, "gold": gold}, lights=[light])
    near = ft.Camera((-2.6, 0.8, 2.2), (0, 0.5, 0), fov_degrees=35, aperture_radius=0.12)
    found = {
        "ray": ("Rays through a lens", replace(flat, camera=near)),
        "hit": ("What rays hit", flat),
        "light": ("Light, by choosing a place on it", with_settings(spheres, bounces=1, estimator="nee")),
        "bsdf": ("Light, by following the material", with_settings(spheres, bounces=1, estimator="bsdf")),
        "mis-nee": ("Lights only", with_settings(polished, bounces=1, estimator="nee")),
        "mis-bsdf": ("Material only", with_settings(polished, bounces=1, estimator="bsdf")),
        "mis": ("Both", with_settings(polished, bounces=1)),
        "bounces-0": ("No bounce", with_settings(box, bounces=0)),
        "bounces-1": ("One bounce", with_settings(box, bounces=1)),
        "bounces-5": ("Five bounces", with_settings(box, bounces=5)),
        "random-hash": ("Hash", with_settings(spheres, sampler="hash")),
        "random-texture": ("Random texture", spheres),
    }
    return {key: replace(scene, name=name) for key, (name, scene) in found.items()}


def with_settings(scene: Scene, **settings: object) -> Scene:
    return replace(scene, render=replace(scene.render, **settings))


def lines_of(path: str, what: str) -> str:
    """Lines of a file: a function by its name, with the comment above it, or ``"FIRST" to "LAST"`` by texts in them.

    Raises
    ------
    ValueError
        If they are not there, or there more than once.
    """
    lines = (CHECKOUT / path).read_text(encoding="utf-8").splitlines()
    if between := re.fullmatch(r'"(.+)" to "(.+)"', what):
        starts = [i for i, line in enumerate(lines) if between[1] in line]
        ends = [i for i in range(starts[0], len(lines)) if between[2] in lines[i]] if starts else []
    else:
        starts = [i for i, line in enumerate(lines) if re.match(rf"\w+ {what}\(.*{{", line)]
        ends = [i for i in range(starts[0], len(lines)) if re.match(r"\S.*}$|}", lines[i])] if starts else []
    if len(starts) != 1 or not ends:
        raise ValueError(f"{path} has {len(starts)} times what docs/method.md shows of it: {what}")
    first = starts[0]
    while not between and lines[first - 1].startswith("//"):
        first -= 1
    found = lines[first : ends[0] + 1]
    indent = min(len(line) - len(line.lstrip()) for line in found if line)
    return "\n".join(line[indent:] for line in found)


def method(text: str) -> str:
    """The page of the method with lines of the shaders and frames in place."""

    def code(found: re.Match[str]) -> str:
        return f'```glsl title="{found[1]}"\n{lines_of(found[1], found[2])}\n```'

    def frames(found: re.Match[str]) -> str:
        frame = '<iframe src="../live/step-{0}.html" title="{0}" loading="lazy"></iframe>'
        return f'<div class="live">{"".join(map(frame.format, found[1].split()))}</div>'

    return LIVE.sub(frames, FENCE.sub(code, text))


def write_documents(folder: Path) -> list[str]:
    """Copy pages of the repository, with what they link to; the names of those of docs/."""
    documents = sorted(f"docs/{path.name}" for path in (CHECKOUT / "docs").glob("*.md"))
    for name in (*PAGES, *documents):
        text = (CHECKOUT / name).read_text(encoding="utf-8")
        for link in LINK.findall(text):
            source = ((CHECKOUT / name).parent / link).resolve()
            if source.is_file() and source.suffix != ".md":
                copy = folder / source.relative_to(CHECKOUT)
                copy.parent.mkdir(parents=True, exist_ok=True)
                shutil.copy(source, copy)
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(ONE_PAGE + method(text) if name == METHOD else text, encoding="utf-8")
    return documents


def write_live(folder: Path, name: str, made: Page) -> None:
    (folder / "live").mkdir(exist_ok=True)
    (folder / "live" / f"{name}.html").write_text(made.text, encoding="utf-8")
    (folder / "live" / f"{name}.webp").write_bytes(made.poster)


def write_gallery(folder: Path, names: list[str], seconds: float) -> None:
    """The live pages of bundled scenes, and the page with their posters."""
    cards = []
    for name in names:
        scene = ft.load(name)
        size = (WIDTH, round(WIDTH * scene.render.height / scene.render.width))
        print(f"gallery: {name}", flush=True)
        write_live(folder, name, page(scene, size, seconds=seconds))
        cards.append(f"[![{name}](live/{name}.webp)](live/{name}.html)\n**{name}**: {bundled()[name]}")
    heading = f"{ONE_PAGE}# Gallery\n\nEach picture leads to a page that traces the scene live."
    posters = "\n\n".join(['<div class="posters" markdown>', *cards, "</div>"])
    (folder / "gallery.md").write_text(f"{heading}\n\n{posters}\n", encoding="utf-8")


def write_reference(folder: Path) -> None:
    """The page of all public names that are functions or classes."""
    text = (
        f'{ONE_PAGE}# Python\n\nNames of `fragtracer`, as in `import fragtracer as ft; ft.load("three-spheres")`.\n\n'
    )
    for name in ft.__all__:
        found = getattr(ft, name)
        if getattr(found, "__name__", None) == name:
            text += f"::: {found.__module__}.{name}\n\n"
    (folder / "api.md").write_text(text, encoding="utf-8")


def make(folder: Path, site: Path, names: list[str], seconds: float) -> None:
    """Write all pages to ``folder``, and the site."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    documents = write_documents(folder)
    (folder / "gallery.css").write_text(CSS, encoding="utf-8")
    shutil.copy(CHECKOUT / "web" / "vendor" / "iframe-worker.js", folder)
    for name, scene in steps().items():
        write_live(folder, f"step-{name}", page(scene, STEP_SIZE, STEP_SPP))
    write_gallery(folder, names, seconds)
    write_reference(folder)
    guide = [name for name in documents if name != METHOD]
    nav = [
        *({"fragtracer": "README.md"}, {"Gallery": "gallery.md"}, {"The method": METHOD}),
        {"Guide": ["scenes/README.md", *guide]},
        *({"Python": "api.md"}, {"Shaders": "shaders/README.md"}),
        {"Development": ["CONTRIBUTING.md", "CHANGELOG.md"]},
    ]
    build(load_config(str(CHECKOUT / "mkdocs.yml"), docs_dir=str(folder), site_dir=str(site), nav=nav, strict=True))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scenes", nargs="*", metavar="SCENE", default=list(bundled()))
    parser.add_argument("--time", type=float, default=30.0, help="seconds for each poster")
    arguments = parser.parse_args()
    logging.basicConfig(level=logging.WARNING, format="%(message)s")
    make(CHECKOUT / "build" / "gallery", CHECKOUT / "site", arguments.scenes, arguments.time)
