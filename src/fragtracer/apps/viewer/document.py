# SPDX-License-Identifier: MIT
"""The edited scene, which parts of it are hidden, and the history for undo and redo."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, TypeAlias

from fragtracer.scene import LIGHTS, SHAPES, Material, Mesh, Scene

Part: TypeAlias = tuple[str, int]  # the name of a tuple of Scene, as "spheres", and the index in it
OBJECTS = (*SHAPES, "meshes")
KINDS = (*OBJECTS, *LIGHTS)
_MOST_STEPS = 200


def is_light(part: Any) -> bool:
    """Whether a part is a light, and no object."""
    return isinstance(part, tuple(LIGHTS.values()))


def materials_of(part: Any) -> list[str]:
    """The names of the materials of an object, each once; none for a light."""
    if isinstance(part, Mesh):
        return list(dict.fromkeys(map(part.material_of, part.parts)))
    return [] if is_light(part) else [part.material]


@dataclass(frozen=True)
class Document:
    """A scene, some of whose objects and lights are hidden but still saved."""

    scene: Scene
    hidden: frozenset[Part] = frozenset()

    @property
    def visible(self) -> Scene:
        """The scene without what is hidden."""
        if not self.hidden:
            return self.scene
        kept: dict[str, Any] = {
            kind: tuple(part for i, part in enumerate(getattr(self.scene, kind)) if (kind, i) not in self.hidden)
            for kind in KINDS
        }
        return replace(self.scene, **kept)

    def part(self, part: Part) -> Any:
        """The object or light at ``part``."""
        return getattr(self.scene, part[0])[part[1]]

    def has(self, part: Part | None) -> bool:
        return part is not None and part[1] < len(getattr(self.scene, part[0]))

    def with_part(self, part: Part, value: Any) -> "Document":
        """This with another object or light in that place."""
        kind, index = part
        parts = list(getattr(self.scene, kind))
        parts[index] = value
        return replace(self, scene=_with_kind(self.scene, kind, parts))

    def with_added(self, kind: str, value: Any) -> "Document":
        """This with one more object or light of ``kind``, the last one."""
        return replace(self, scene=_with_kind(self.scene, kind, [*getattr(self.scene, kind), value]))

    def without_part(self, part: Part) -> "Document":
        """This without an object or light; the ones after it move up."""
        kind, index = part
        parts = list(getattr(self.scene, kind))
        del parts[index]
        moved = {(k, i - (k == kind and i > index)) for k, i in self.hidden if (k, i) != part}
        return Document(_with_kind(self.scene, kind, parts), frozenset(moved))

    def with_material(self, name: str, material: Material) -> "Document":
        materials: Mapping[str, Material] = {**self.scene.materials, name: material}
        return replace(self, scene=replace(self.scene, materials=materials))

    def with_hidden(self, part: Part, hidden: bool) -> "Document":
        return replace(self, hidden=self.hidden | {part} if hidden else self.hidden - {part})


@dataclass
class History:
    """The document now, and the states that undo and redo return to."""

    now: Document
    past: list[Document] = field(default_factory=list)
    future: list[Document] = field(default_factory=list)
    _label: str = ""  # of the last step
    _is_open: bool = False

    def edit(self, document: Document, label: str, joins: bool = False) -> bool:
        """Add a step, or merge it with the last one if that has the same ``label`` and, unless it ``joins``,
        :meth:`close` was not called since: the drag of a slider is one step. Returns whether anything changed."""
        if document == self.now:
            return False
        if label != self._label or not (self._is_open or joins):
            self.past = [*self.past, self.now][-_MOST_STEPS:]
        self._label, self._is_open, self.now, self.future = label, True, document, []
        return True

    def map(self, change: Callable[[Document], Document]) -> None:
        """Apply ``change`` to the document, and to all that undo and redo return to; all stays if it raises."""
        self.now, self.past, self.future = change(self.now), [*map(change, self.past)], [*map(change, self.future)]

    def close(self) -> None:
        """The next edit is a step of its own."""
        self._is_open = False

    def undo(self) -> bool:
        return self._step(self.past, self.future)

    def redo(self) -> bool:
        return self._step(self.future, self.past)

    def _step(self, source: list[Document], target: list[Document]) -> bool:
        if not source:
            return False
        target.append(self.now)
        self.now = source.pop()
        self._label = ""
        return True


def _with_kind(scene: Scene, kind: str, parts: list[Any]) -> Scene:
    changes: dict[str, Any] = {kind: tuple(parts)}
    return replace(scene, **changes)
