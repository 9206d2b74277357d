# SPDX-License-Identifier: MIT
"""``fragtracer info``: OpenGL and Mitsuba on this machine; or what a scene holds."""

import platform
from collections.abc import Iterator
from importlib.util import find_spec
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fragtracer import __version__
from fragtracer.apps.cli.options import SCENE_HELP
from fragtracer.apps.cli.words import counted
from fragtracer.errors import FragtracerError

if TYPE_CHECKING:
    from fragtracer.scene import Mesh, Scene


def info(scene: Annotated[str | None, typer.Argument(help=SCENE_HELP)] = None) -> None:
    """Print the OpenGL vendor, renderer, version and limits, and what is missing; with a SCENE, what is in it."""
    if scene is not None:
        from fragtracer.io.toml import load
        from fragtracer.renderer import warn_if_dark

        loaded = load(scene)
        warn_if_dark(loaded)
        print("\n".join(contents(loaded)))
        _print_guiding(loaded)
        return
    print(f"fragtracer {__version__}, Python {platform.python_version()}, {platform.platform()}")
    works = _print_opengl()
    _print_mitsuba()
    if not works:
        raise typer.Exit(2)


def contents(scene: "Scene") -> Iterator[str]:
    """The lines that say what ``scene`` holds."""
    from fragtracer.scene import LIGHTS, SHAPES

    yield f"{scene.name}: {scene.description}" if scene.description else scene.name
    yield _line("camera", f"at {_row(scene.camera.position)}, to {_row(scene.camera.target)}")
    for kind in (*SHAPES, "meshes", *LIGHTS, "materials"):
        if count := len(getattr(scene, kind)):
            yield _line(kind.replace("_", " "), f"{count}")
    for name, material in scene.materials.items():
        if material.blend is not None:
            times = ", times a texture" if material.blend_weight_texture else ""
            yield _line("blend", f"{name}: {material.blend} by {material.blend_weight:.4g}{times}")
    told: set[str] = set()
    for mesh in scene.meshes:
        yield from _mesh(mesh)
        if mesh.file and mesh.file not in told:
            told.add(mesh.file)
            yield from _animations(mesh.file)


def _print_guiding(scene: "Scene") -> None:
    """Whether light of a picture of ``scene`` would be traced from the lights, and its paths be guided, and why."""
    from fragtracer.apps.cli.preparation import preparing
    from fragtracer.gpu.context import create_context
    from fragtracer.light_tracing import decide_both

    try:
        with create_context() as context:
            with preparing():
                traced, guided = decide_both(context, scene, scene.render)
            print(_line("light tracing", traced.reason))
            print(_line("guiding", guided.reason))
    except FragtracerError as error:
        print(_line("guiding", f"not known: {error}"))


def _mesh(mesh: "Mesh") -> Iterator[str]:
    from fragtracer.io import bounds

    low, high = bounds(mesh)
    triangles = sum(len(part.geometry.triangles) for part in mesh.parts)
    instances = f", {len(mesh.instances)} instances" if len(mesh.instances) != 1 else ""
    yield _line("mesh", f"{mesh.name}: {triangles} triangles in {len(mesh.parts)} parts{instances}")
    yield _line("", f"from {_row(low)} to {_row(high)} m")


def _animations(file: str) -> Iterator[str]:
    """Those of a model, with how long they last and how many things they move."""
    from fragtracer.io import AnimationError, open_gltf

    try:
        animations = open_gltf(file).animations
    except AnimationError:  # another kind of file
        return
    for number, name in enumerate(animations.names):
        try:
            found = animations.get(name)
            text = f"{found.duration:.4g} s, {counted(len(found.curves), 'channel')}"
        except FragtracerError as error:
            text = f"not known: {error}"
        yield _line("animation", f"{number} {name}: {text}")


def _line(name: str, text: str) -> str:
    return f"{name:19} {text}"


def _row(values: Any) -> str:
    return f"[{', '.join(f'{value:.4g}' for value in values)}]"


def _print_opengl() -> bool:
    from fragtracer.gpu.context import create_context, describe

    try:
        context = create_context()
    except FragtracerError as error:
        print(f"OpenGL         missing: {error}")
        return False
    for name, value in describe(context).items():
        print(f"{name:14} {value}")
    context.release()
    return True


def _print_mitsuba() -> None:
    if find_spec("mitsuba") is None:
        print("Mitsuba        missing: pip install 'fragtracer[reference]' (needed by compare alone)")
        return
    from importlib.metadata import version

    from fragtracer.reference.variant import choose_variant

    print(f"Mitsuba        {version('mitsuba')}, variant {choose_variant()}")
