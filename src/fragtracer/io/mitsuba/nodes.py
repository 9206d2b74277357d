# SPDX-License-Identifier: MIT
"""The plugins of a Mitsuba scene file, read by Mitsuba's own parser."""

import re
from collections.abc import Container, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from fragtracer.errors import SceneError
from fragtracer.interruption import deferred
from fragtracer.scene.fields import Triple

VARIANT = "scalar_rgb"  # which needs no LLVM


@contextmanager
def mitsuba(path: Path) -> Iterator[Any]:
    """The module, in the variant that reads files and without its log, for the block; what it refuses is a SceneError.

    Raises
    ------
    SceneError
        If Mitsuba is not installed, or raises an error in the block.
    """
    with deferred():
        try:
            import mitsuba as mi
        except ImportError as error:
            raise SceneError(
                f"{path}: Mitsuba, which reads its scene files, is not installed; pip install 'fragtracer[reference]'"
            ) from error
        before = mi.variant()
        mi.set_variant(VARIANT)
    level = mi.log_level()
    mi.set_log_level(mi.LogLevel.Error)
    try:
        yield mi
    except RuntimeError as error:
        raise SceneError(f"{path}: {reason(error)}") from None
    finally:
        mi.set_log_level(level)
        if before:
            mi.set_variant(before)


def reason(error: RuntimeError) -> str:
    """What Mitsuba says, without the places in its own source."""
    text = re.sub(r"\[\w+\.(cpp|h):\d+\] ?|(At|While loading) dictionary node \"\w+\": ?", "", str(error))
    return " ".join(text.split())


def refusal(error: ValueError) -> str:
    """What a check of the scene model says."""
    if not isinstance(error, ValidationError):
        return str(error)
    detail = error.errors(include_url=False)[0]
    place = "".join(f"{name} " for name in detail["loc"][:1])
    return place + detail["msg"].removeprefix("Value error, ").replace("Input should be", "must be")


def fresh(stem: str, taken: Container[str]) -> str:
    """A name that is not taken: ``stem``, or that and a number."""
    name, number = stem, 1
    while name in taken:
        number += 1
        name = f"{stem} {number}"
    return name


@dataclass(eq=False)
class Node:
    """A plugin: its ``kind``, as "bsdf", its type, and its parameters, which are asked for by name."""

    kind: str
    plugin: str
    id: str
    where: str  # the file and the line, which errors begin with
    line: str  # the line alone, or in which included file it is, which notes begin with
    folders: tuple[Path, ...]  # that file names are relative to, the first where there is such a file
    files: list[Path]  # all that are named, and included, of all plugins
    props: Any
    names: tuple[str, ...]  # of its parameters
    named: dict[str, "Node"] = field(default_factory=dict)
    children: list["Node"] = field(default_factory=list)  # those without a name
    asked: set[str] = field(default_factory=set)

    def has(self, name: str) -> bool:
        return name in self.props

    def number(self, name: str, default: float) -> float:
        return float(self._value(name, default, (int, float)))

    def whole(self, name: str, default: int) -> int:
        return int(self._value(name, default, (int,)))

    def flag(self, name: str, default: bool) -> bool:
        return bool(self._value(name, default, (bool,)))

    def text(self, name: str, default: str) -> str:
        return str(self._value(name, default, (str,)))

    def file(self, name: str = "filename") -> Path:
        """The path of the file that is named."""
        if not self.has(name):
            raise self.error(f"{name} is missing")
        paths = [folder / self.text(name, "") for folder in self.folders]
        found = next((path for path in paths if path.is_file()), None)
        if found is None:
            raise self.error(f"{name}: there is no file {paths[0]}")
        if found not in self.files:
            self.files.append(found)
        return found

    def vector(self, name: str, default: Triple) -> NDArray[np.float64]:
        """Three numbers."""
        self.asked.add(name)
        if not self.has(name):
            return np.array(default)
        value = None if self._is_node(name) else self.props[name]
        if value is None or isinstance(value, (str, int, float)) or np.shape(value) != (3,):
            raise self.error(f"{name} must be a vector or a point")
        return np.array(value, np.float64)

    def matrix(self, name: str = "to_world") -> NDArray[np.float64]:
        """(4, 4), the identity where it is left out."""
        self.asked.add(name)
        if not self.has(name):
            return np.eye(4)
        value = None if self._is_node(name) else self.props[name]
        if value is None or not hasattr(value, "matrix"):
            raise self.error(f"{name} must be a transform")
        matrix = np.array(value.matrix, np.float64)
        if not (np.isfinite(matrix).all() and np.abs(matrix[3] - (0, 0, 0, 1)).max() < 1e-6):
            raise self.error(f"{name} must be a matrix of finite numbers, its last row 0 0 0 1")
        return matrix

    def child(self, *kinds: str) -> "Node | None":
        """The first of these kinds that has no name, or whatever name."""
        return next(iter(self.all(*kinds)), None)

    def all(self, *kinds: str) -> list["Node"]:
        """Those of these kinds, with a name and without."""
        return [node for node in (*self.children, *self.named.values()) if node.kind in kinds]

    @property
    def unused(self) -> list[str]:
        """Parameters that were not asked for."""
        return [name for name in self.names if name not in self.asked and not self._is_node(name)]

    @cached_property
    def title(self) -> str:
        """What messages call it."""
        return f'<{self.kind} type="{self.plugin}">' + (f" {self.id!r}" if self.id else "")

    def error(self, message: str) -> SceneError:
        return SceneError(f"{self.where}: {self.title}: {message}")

    @contextmanager
    def checked(self) -> Iterator[None]:
        """Make what the scene model or Mitsuba refuses an error of this plugin."""
        try:
            yield
        except ValueError as error:
            raise self.error(refusal(error)) from None
        except RuntimeError as error:
            raise self.error(reason(error)) from None

    def as_dict(self, *chosen: str) -> dict[str, Any]:
        """The plugin and its parameters, those that are ``chosen`` or all, for ``mi.load_dict``; no other plugins among
        them."""
        names = [name for name in self.names if not self._is_node(name) and (not chosen or name in chosen)]
        self.asked.update(names)
        values = {name: self.props[name] for name in names}
        return {"type": self.plugin} | {name: _loadable(value) for name, value in values.items()}

    def _is_node(self, name: str) -> bool:
        return name in self.named or name.startswith("_arg_")

    def _value(self, name: str, default: Any, kinds: tuple[type, ...]) -> Any:
        self.asked.add(name)
        if not self.has(name):
            return default
        value = None if self._is_node(name) else self.props[name]
        if not isinstance(value, kinds) or (isinstance(value, bool) and bool not in kinds):
            kind = {bool: "true or false", int: "a whole number", float: "a number", str: "text"}[kinds[-1]]
            raise self.error(f"{name} must be {kind}")
        return value


def _loadable(value: Any) -> Any:
    """A parameter as ``mi.load_dict`` takes it."""
    import mitsuba as mi

    match type(value).__name__:
        case "AffineTransform4d":
            return mi.ScalarTransform4f(value.matrix)
        case "Color3d":
            return {"type": "rgb", "value": [float(x) for x in value]}
        case "Spectrum" if value.is_uniform():
            return float(value.values[0])
        case "Spectrum":
            return {"type": "spectrum", "value": list(zip(value.wavelengths, value.values, strict=True))}
        case "Vector3d" | "Point3d" | "ScalarVector3d":
            return [float(x) for x in value]
    return value


def instantiated(mi: Any, path: Path) -> Any:
    """Mitsuba's scene of a file, in the variant that is active, without the integrator and the sensors that lie in no
    medium: films of older versions, say, it does not know. Raises RuntimeError if Mitsuba refuses it."""
    with _beside(mi, path):
        config, state = _parsed(mi, path, mi.variant())
        nodes, props = list(state.nodes), state.root.props
        for name in list(props.keys()):
            if props.type(name) == mi.Properties.Type.ResolvedReference:
                node = nodes[props[name].index()]
                is_in_medium = any(kind == "Medium" for kind in _kinds_within(nodes, node.props))
                if node.type.name == "Integrator" or (node.type.name == "Sensor" and not is_in_medium):
                    del props[name]
        mi.parser.transform_all(config, state)
        return mi.parser.instantiate(config, state)


@contextmanager
def _beside(mi: Any, path: Path) -> Iterator[None]:
    """Have Mitsuba look for files beside ``path`` first, for the block."""
    before = mi.file_resolver()
    resolver = mi.FileResolver()
    for folder in (path.absolute().parent, *before):
        resolver.append(str(folder))
    mi.set_file_resolver(resolver)
    try:
        yield
    finally:
        mi.set_file_resolver(before)


def _kinds_within(nodes: list[Any], props: Any) -> Iterator[str]:
    """Those of the plugins among parameters, as far as these are not named by references."""
    for name, value in props.items():
        if props.type(name).name == "ResolvedReference":
            yield str(nodes[value.index()].type.name)


def _parsed(mi: Any, path: Path, variant: str) -> tuple[Any, Any]:
    config = mi.parser.ParserConfig(variant)
    config.unused_parameters = config.unused_properties = mi.LogLevel.Debug
    return config, mi.parser.parse_file(config, str(path))


def parse(mi: Any, path: Path) -> Node:
    """The ``scene`` of a file, within :func:`mitsuba`. Raises SceneError if it is none."""
    with _beside(mi, path):
        config, state = _parsed(mi, path, VARIANT)
        mi.parser.transform_upgrade(config, state)
        mi.parser.transform_resolve(config, state)
    nodes = list(state.nodes)
    files = [Path(str(file)) for file in state.files]
    ends = [np.flatnonzero(np.frombuffer(file.read_bytes(), np.uint8) == ord("\n")) for file in files]
    made: dict[int, Node] = {}
    used = files[1:]

    def node(index: int) -> Node:
        if index not in made:
            plugin = nodes[index]
            file = files[plugin.file_index]
            number = int(np.searchsorted(ends[plugin.file_index], plugin.offset)) + 1
            kind = _KINDS.get(plugin.type.name, plugin.type.name.lower())
            where = f"{file}:{number}"
            line = f"line {number}" + ("" if plugin.file_index == 0 else f" of {file.name}")
            props = plugin.props
            names = tuple(props.keys())
            found = Node(
                kind, props.plugin_name(), props.id(), where, line, (path.parent, file.parent), used, props, names
            )
            made[index] = found
            for name in names:
                if props.type(name) == mi.Properties.Type.ResolvedReference:
                    other = node(props[name].index())
                    if name.startswith("_arg_"):
                        found.children.append(other)
                    else:
                        found.named[name] = other
        return made[index]

    root = node(0)
    if root.kind != "scene":
        raise SceneError(f"{path}: this is a Mitsuba <{root.kind}>; a file holds a <scene>")
    return root


_KINDS = {"PhaseFunction": "phase", "ReconstructionFilter": "rfilter"}  # others have the names of the tags
