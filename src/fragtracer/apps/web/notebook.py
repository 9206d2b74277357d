# SPDX-License-Identifier: MIT
"""A live page in a cell of a notebook, whose camera and settings are Python's too (web/src/widget.ts)."""

import re
from collections.abc import Mapping
from dataclasses import asdict, replace
from importlib.resources import files
from numbers import Integral, Real
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
        given = dict(proposal["value"])
        for name, value in given.items():
            if name not in self._controls:
                raise traitlets.TraitError(f"there is no setting {name!r}; there are {', '.join(self._controls)}")
            try:
                given[name] = _checked(self._controls[name], value)
            except ValueError as error:
                raise traitlets.TraitError(f"{name}: {error}, got {value!r}") from None
        before = self.settings if self.trait_has_value("settings") else {}
        return MappingProxyType({**before, **given})


def _checked(control: Control, value: Any) -> int | float | str:
    """A value of a control as the page has it; raises ValueError if it is none."""
    if "choices" in control:
        if value not in control["choices"]:
            raise ValueError(f"must be one of {', '.join(control['choices'])}")
        return str(value)
    if "min" in control:
        least, most = control["min"], control["max"]
        kind, name = (Integral, "an integer") if control["effect"] == "set" else (Real, "a number")
        if not (isinstance(value, kind) and not isinstance(value, bool) and least <= value <= most):
            raise ValueError(f"must be {name} from {least:g} to {most:g}")
        return int(value) if isinstance(value, Integral) else float(value)
    if not re.fullmatch("#[0-9a-f]{6}", str(value).lower()):
        raise ValueError("must be a colour, as '#ff8000'")
    return str(value).lower()
