# SPDX-License-Identifier: MIT
"""A live page in a cell of a notebook, whose camera and settings are Python's too (web/src/widget.ts)."""

import re
from collections.abc import Mapping
from dataclasses import asdict, replace
from importlib.resources import files
from types import MappingProxyType
from typing import Any

import anywidget
import traitlets

from fragtracer.apps.web import Page
from fragtracer.apps.web.controls import Control
from fragtracer.apps.web.payload import controls_by_name
from fragtracer.scene import Camera, Scene


class Widget(anywidget.AnyWidget):
    """``scene``, traced live by the reader's browser.

    Attributes
    ----------
    camera : Camera
        What the picture is seen by: follows the reader, and leads when it is set.
    settings : Mapping[str, float or str]
        Values of the page's controls by name ("exposure", "tonemap", "bounces", "light_samples", and more by what the
        scene holds). Read-only: assigning a mapping changes the values that it names.
    scene : Scene
        The scene as it was given, but with this camera, these bounces and light samples.
    """

    _esm = files("fragtracer.apps.web").joinpath("widget.js").read_text(encoding="utf-8")
    html = traitlets.Unicode().tag(sync=True)
    camera = traitlets.Instance(Camera).tag(
        sync=True, to_json=lambda value, _: asdict(value), from_json=lambda value, _: Camera(**value)
    )
    settings = traitlets.Instance("collections.abc.Mapping").tag(
        sync=True, to_json=lambda value, _: dict(value), from_json=lambda value, _: value
    )

    def __init__(self, scene: Scene, page: Page) -> None:
        self._scene = scene
        self._controls = controls_by_name(scene, page.settings, page.look)
        first = {name: control["value"] for name, control in self._controls.items()}
        super().__init__(html=page.text, camera=scene.camera, settings=first)

    @property
    def scene(self) -> Scene:
        of = self.settings
        render = replace(self._scene.render, bounces=of["bounces"], light_samples=of["light_samples"])
        return replace(self._scene, camera=self.camera, render=render)

    @traitlets.validate("settings")
    def _merged(self, proposal: Mapping[str, Any]) -> Mapping[str, Any]:
        given = proposal["value"]
        for name, value in given.items():
            if name not in self._controls:
                raise traitlets.TraitError(f"there is no setting {name!r}; there are {', '.join(self._controls)}")
            problem = _problem(self._controls[name], value)
            if problem:
                raise traitlets.TraitError(f"{name}: {problem}, got {value!r}")
        before = self.settings if self.trait_has_value("settings") else {}
        return MappingProxyType({**before, **given})


def _problem(control: Control, value: Any) -> str | None:
    """What is wrong with a value of a control, if anything is."""
    if "choices" in control:
        return None if value in control["choices"] else f"must be one of {', '.join(control['choices'])}"
    if "min" in control:
        least, most = control["min"], control["max"]
        counts = control["effect"] == "set"
        is_number = isinstance(value, int if counts else int | float) and not isinstance(value, bool)
        kind = "an integer" if counts else "a number"
        return None if is_number and least <= value <= most else f"must be {kind} from {least:g} to {most:g}"
    return None if re.fullmatch("#[0-9a-f]{6}", str(value)) else "must be a colour, as '#ff8000'"
