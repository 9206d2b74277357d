# SPDX-License-Identifier: MIT
"""Shapes of a Mitsuba scene. Triangles are read by Mitsuba itself.

Spheres, rectangles and disks become ours, or triangles where they have textures, are turned inside out, or are
sheared. A cylinder is triangles. Instances share their triangles.
"""

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fragtracer.io.mitsuba.bsdfs import Materials
from fragtracer.io.mitsuba.media import Media
from fragtracer.io.mitsuba.nodes import Node, fresh
from fragtracer.io.mitsuba.textures import VERTEX_COLORS, Lengths
from fragtracer.io.model import matrix_rows, triple
from fragtracer.scene import Disk, Geometry, Mesh, Part, Rectangle, Sphere

Floats = NDArray[np.float64]

_TRIANGLES = ("obj", "ply", "serialized", "cube", "rectangle")  # what Mitsuba reads as such
_UNEVEN = 0.1  # the relative deviation of how texture coordinates are stretched, from which on a note says so
_ROUND = ("sphere", "disk", "cylinder")
_WITHOUT_FILE = ("cube", "rectangle")
_OF_TRIANGLES = ("to_world", "face_normals", "flip_normals", "flip_tex_coords", "shape_index")  # parameters of these
_AROUND, _ALONG = 128, 64  # triangles of round shapes


@dataclass
class Shapes:
    """The shapes of a scene, as they are added. ``notes`` are what is not as in Mitsuba."""

    mi: Any
    materials: Materials
    media: Media
    notes: list[str]
    spheres: list[Sphere] = field(default_factory=list)
    rectangles: list[Rectangle] = field(default_factory=list)
    disks: list[Disk] = field(default_factory=list)
    meshes: list[Mesh] = field(default_factory=list)
    _geometries: dict[Hashable, Geometry] = field(default_factory=dict)
    _groups: dict[Node, list[Part]] = field(default_factory=dict)
    _names: set[str] = field(default_factory=set)  # of meshes

    def add(self, node: Node) -> None:
        """A shape with all that belongs to it."""
        with node.checked():
            self._add(node)

    def _add(self, node: Node) -> None:
        if node.plugin == "shapegroup":
            return
        if node.plugin == "instance":
            group = node.child("shape")
            if group is None or group.plugin != "shapegroup":
                raise node.error('it names no <shape type="shapegroup">')
            parts = self._groups.setdefault(group, [])
            for shape in group.all("shape"):
                parts += self._parts(shape, node.matrix())
            return
        self._add_mesh(node, self._parts(node, np.eye(4)))

    def add_instances(self) -> None:
        """A mesh of each group, of all its instances."""
        for group, parts in self._groups.items():
            self._add_mesh(group, parts)

    def _add_mesh(self, node: Node, parts: Sequence[Part]) -> None:
        if parts:
            name = fresh(node.id or Path(node.text("filename", node.plugin)).stem, self._names)
            self._names.add(name)
            self.meshes.append(Mesh(tuple(parts), name=name))

    def _parts(self, node: Node, to_world: Floats) -> list[Part]:
        """The triangles of a shape; what is none is added to the lists."""
        if node.plugin == "merge":
            return [part for shape in node.all("shape") for part in self._parts(shape, to_world)]
        interior = node.named.get("interior")
        medium = None if interior is None else self.media.name(interior)
        bsdf = node.child("bsdf")
        lengths = self._lengths(node, to_world) if self.materials.is_bumped(bsdf) else None
        name = self.materials.name(bsdf, node.child("emitter"), medium, lengths)
        is_flipped = node.flag("flip_normals", False)
        placed = to_world @ node.matrix()
        if node.plugin in _ROUND and not abs(np.linalg.det(placed[:3, :3])) > 0:
            raise node.error("to_world flattens it; scale by numbers other than 0")
        blended = [self.materials.found[n] for n in (name, self.materials.found[name].blend) if n is not None]
        is_plain = not any(material.textures or material.anisotropy for material in blended)
        match node.plugin:
            case "sphere":
                center = node.vector("center", (0.0, 0.0, 0.0))
                local = np.eye(4)
                local[:3] = np.column_stack([_radius(node) * np.eye(3), center])
                placed = placed @ local
                if is_plain and not is_flipped and (size := _scale(placed[:3, :3])):
                    self.spheres.append(Sphere(center=triple(placed[:3, 3]), radius=size, material=name))
                    return []
                return [self._part(node, name, to_world, lambda: _sphere(node.matrix() @ local, is_flipped))]
            case "disk":
                normal = np.cross(placed[:3, 0], placed[:3, 1]) * np.sign(np.linalg.det(placed[:3, :3]))
                if is_plain and (size := _scale(placed[:3, :2])):
                    normal = -normal if is_flipped else normal
                    self.disks.append(Disk(triple(placed[:3, 3]), triple(normal), size, name))
                    return []
                return [self._part(node, name, to_world, lambda: _disk(node.matrix(), is_flipped))]
            case "cylinder":
                ends = node.vector("p0", (0.0, 0.0, 0.0)), node.vector("p1", (0.0, 0.0, 1.0))
                radius = _radius(node)
                if np.array_equal(*ends):
                    raise node.error("p0 and p1 must differ")
                self.notes.append(f"{node.line}: {node.title}, {_AROUND} flat sides in its place")
                return [self._part(node, name, to_world, lambda: _cylinder(*ends, radius, node.matrix(), is_flipped))]
            case kind if kind in _TRIANGLES:
                part = self._triangles(node, name, to_world)
                if kind == "rectangle" and is_plain and (flat := _rectangle(part)):
                    self.rectangles.append(flat)
                    return []
                return [part]
        self.notes.append(f"{node.line}: {node.title}")
        return []

    def _part(self, node: Node, name: str, to_world: Floats, make: Callable[[], Geometry]) -> Part:
        if node not in self._geometries:
            self._geometries[node] = make()
        return Part(self._geometries[node], name, matrix_rows(to_world))

    def _triangles(self, node: Node, name: str, to_world: Floats) -> Part:
        """Those of a file, or of one of Mitsuba's own shapes.

        Shapes of the same file share them, but where a transform shears or mirrors, which changes the normals that
        Mitsuba makes.
        """
        matrix = node.matrix()
        is_similar = _scale(matrix[:3, :3]) > 0 and np.linalg.det(matrix[:3, :3]) > 0
        tree = node.as_dict(*_OF_TRIANGLES) | ({} if node.plugin in _WITHOUT_FILE else {"filename": str(node.file())})
        placed = tree.pop("to_world", None)
        is_colored = self.materials.is_colored(name)
        key: Hashable = (is_colored, *sorted((key, str(value)) for key, value in tree.items())) if is_similar else node
        if key not in self._geometries:
            self._geometries[key] = self._read(node, tree if is_similar else tree | {"to_world": placed}, is_colored)
        return Part(self._geometries[key], name, matrix_rows(to_world @ matrix if is_similar else to_world))

    def _lengths(self, node: Node, to_world: Floats) -> Lengths | None:
        """In metres, along which u and v of the texture coordinates of a shape grow by 1: the mean over its area."""
        if node.plugin not in _TRIANGLES:
            return None
        part = self._triangles(node, "", to_world)
        geometry, uvs = part.geometry, part.geometry.uvs
        if uvs is None or not len(geometry.triangles):
            return None
        corners = (geometry.positions @ np.array(part.matrix)[:3, :3].T)[geometry.triangles]
        edges = corners[:, 1:] - corners[:, :1]
        steps = uvs[geometry.triangles].astype(np.float64)
        steps = steps[:, 1:] - steps[:, :1]
        area = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)
        is_mapped = np.abs(np.linalg.det(steps)) > 1e-12
        if not (area * is_mapped).any():
            return None
        lengths = np.linalg.norm(np.linalg.solve(steps[is_mapped], edges[is_mapped]), axis=2)
        means = np.average(lengths, axis=0, weights=area[is_mapped])
        spread = np.sqrt(np.average(np.square(lengths / means - 1), axis=0, weights=area[is_mapped])).max()
        if spread > _UNEVEN:
            self.notes.append(f"{node.line}: the bumps of {node.title}, on which texture coordinates are stretched")
        u, v = means.tolist()
        return u, v

    def _read(self, node: Node, tree: dict[str, Any], is_colored: bool) -> Geometry:
        """The triangles of a plugin."""
        mesh = self.mi.load_dict(tree)
        positions = np.array(mesh.vertex_positions_buffer(), np.float64).reshape(-1, 3)
        triangles = np.array(mesh.faces_buffer(), np.int64).reshape(-1, 3)
        normals = _columns(mesh.vertex_normals_buffer(), 3) if mesh.has_vertex_normals() else None
        uvs = _columns(mesh.vertex_texcoords_buffer(), 2) if mesh.has_vertex_texcoords() else None
        is_colored = is_colored and mesh.has_attribute(VERTEX_COLORS)
        colors = _columns(mesh.attribute_buffer(VERTEX_COLORS), 3) if is_colored else None
        if normals is not None:
            # Mitsuba takes the side of the vertex normals for the front.
            a, b, c = (positions[triangles[:, i]] for i in range(3))
            sides = (np.cross(b - a, c - a) * normals[triangles].sum(axis=1)).sum(axis=1)
            triangles[sides < 0] = triangles[sides < 0][:, ::-1]
        if node.flag("flip_normals", False):
            triangles = triangles[:, ::-1]
            normals = None if normals is None else -normals
        with node.checked():
            return Geometry(positions, triangles, normals, uvs, colors=colors)


def _columns(buffer: Any, count: int) -> Floats:
    return np.nan_to_num(np.array(buffer, np.float64).reshape(-1, count), posinf=0.0, neginf=0.0)


def _radius(node: Node) -> float:
    radius = node.number("radius", 1.0)
    if not radius > 0:
        raise node.error(f"radius must be above 0, not {radius:g}")
    return radius


def _scale(matrix: Floats) -> float:
    """The length of the columns of ``matrix`` (3, n), if they all have the same and are perpendicular; else 0."""
    product = matrix.T @ matrix
    size = float(np.sqrt(product[0, 0]))
    return size if np.allclose(product, size**2 * np.eye(len(product)), rtol=0, atol=1e-5 * size**2) else 0.0


def _rectangle(part: Part) -> Rectangle | None:
    """The two triangles of Mitsuba's rectangle as one of ours, if its sides are perpendicular."""
    matrix = np.array(part.matrix)
    corners = part.geometry.positions @ matrix[:3, :3].T + matrix[:3, 3]
    a, b, c, _ = corners  # (-1, -1), (1, -1), (-1, 1) of its plane
    u, v = b - a, c - a
    if abs(u @ v) > 5e-5 * np.linalg.norm(u) * np.linalg.norm(v) or not np.linalg.norm(np.cross(u, v)) > 0:
        return None
    p, q, r = corners[part.geometry.triangles[0]]
    if np.cross(q - p, r - p) @ np.cross(u, v) < 0:
        u, v = v, u
    return Rectangle(triple(a), triple(u), triple(v), part.material)


def _grid(rows: int, columns: int) -> NDArray[np.int64]:
    """Triangles (n, 3) of a grid of so many rows and columns of vertices, counter-clockwise with rows up."""
    first = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    one = np.column_stack([first, first + 1, first + columns + 1])
    return np.concatenate([one, np.column_stack([first, first + columns + 1, first + columns])])


def _placed(points: Floats, normals: Floats, uvs: Floats, triangles: Any, matrix: Floats, flipped: bool) -> Geometry:
    """A geometry whose front is on the side of its normals, or turned inside out."""
    positions = points @ matrix[:3, :3].T + matrix[:3, 3]
    turned = normals @ np.linalg.inv(matrix[:3, :3])
    a, b, c = (positions[triangles[:, i]] for i in range(3))
    sides = (np.cross(b - a, c - a) * turned[triangles].sum(axis=1)).sum(axis=1)
    ordered = np.where((sides < 0)[:, None] != flipped, triangles[:, ::-1], triangles)
    return Geometry(positions, ordered, -turned if flipped else turned, uvs)


def _sphere(matrix: Floats, flipped: bool) -> Geometry:
    u, v = np.meshgrid(np.linspace(0, 1, _AROUND + 1), np.linspace(0, 1, _ALONG + 1))
    phi, theta = 2 * np.pi * u, np.pi * v
    points = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], -1).reshape(-1, 3)
    uvs = np.stack([u, v], -1).reshape(-1, 2)
    return _placed(points, points, uvs, _grid(_ALONG + 1, _AROUND + 1), matrix, flipped)


def _disk(matrix: Floats, flipped: bool) -> Geometry:
    radius, turn = np.meshgrid(np.linspace(0, 1, 2), np.linspace(0, 1, _AROUND + 1))
    phi = 2 * np.pi * turn
    points = np.stack([radius * np.cos(phi), radius * np.sin(phi), np.zeros_like(phi)], -1).reshape(-1, 3)
    normals = np.broadcast_to((0.0, 0.0, 1.0), points.shape)
    uvs = np.stack([radius, turn], -1).reshape(-1, 2)
    return _placed(points, normals, uvs, _grid(_AROUND + 1, 2), matrix, flipped)


def _cylinder(low: Floats, high: Floats, radius: float, matrix: Floats, flipped: bool) -> Geometry:
    axis = high - low
    z = axis / np.linalg.norm(axis)
    x = np.cross(z, np.eye(3)[np.argmin(np.abs(z))])
    x /= np.linalg.norm(x)
    u, v = np.meshgrid(np.linspace(0, 1, _AROUND + 1), np.linspace(0, 1, 2))
    phi = 2 * np.pi * u[..., None]
    normals = (np.cos(phi) * x + np.sin(phi) * np.cross(z, x)).reshape(-1, 3)
    points = low + radius * normals + v.reshape(-1, 1) * axis
    return _placed(points, normals, np.stack([u, v], -1).reshape(-1, 2), _grid(2, _AROUND + 1), matrix, flipped)
