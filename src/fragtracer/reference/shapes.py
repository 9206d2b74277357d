# SPDX-License-Identifier: MIT
"""Places cameras and shapes as Mitsuba does: by matrices from its local frames to the world.

The dictionaries are those of :func:`fragtracer.reference.translate.scene_tree`.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fragtracer.scene import LIGHTS, SHAPES, Camera, Disk, Mesh, Plane, Rectangle, Scene, Sphere

Tree = dict[str, Any]
Matrix = NDArray[np.float64]
Columns = dict[str, NDArray[np.float64]]


def rgb(color: Any) -> Tree:
    """A colour, linear Rec. 709."""
    return {"type": "rgb", "value": [float(c) for c in color]}


RIM_PIXELS = 2e-5  # the rim lies below the horizon by less than this
# The radius of a sphere that is a ground: times the camera's distance from it, and times what rounding is relative to.
_NEAR, _LARGE = 10.0, 30.0
_STEP = 0.04  # of their distance from the foot of the camera: the edges of its triangles
_NEAREST = 1e-5  # radians: the distance of the first ring of them


def matrix(x: ArrayLike, y: ArrayLike, z: ArrayLike, origin: ArrayLike) -> Matrix:
    """The 4 × 4 matrix that takes the axes to ``x``, ``y``, ``z`` and the origin to ``origin``."""
    result = np.eye(4)
    result[:3] = np.column_stack([x, y, z, origin])
    return result


def camera_to_world(camera: Camera) -> Matrix:
    """Mitsuba's camera looks along its +z with +x to the left of the picture, and is right-handed so."""
    ahead = _unit(np.subtract(camera.target, camera.position))
    left = _unit(np.cross(camera.up, ahead))
    return matrix(left, np.cross(ahead, left), ahead, camera.position)


def towards(origin: ArrayLike, direction: ArrayLike) -> Matrix:
    """A matrix that takes the origin to ``origin`` and +z along ``direction`` (of any length)."""
    z = _unit(direction)
    x = _unit(np.cross(z, np.eye(3)[np.argmin(np.abs(z))]))
    return matrix(x, np.cross(z, x), z, origin)


def bounding_radius(scene: Scene) -> float:
    """Radius in metres of the sphere around the camera that bounds everything finite."""
    eye = np.asarray(scene.camera.position)
    points: list[tuple[ArrayLike, float]] = [(scene.camera.target, 0.0)]
    boxes = [shape.bounds for kind in SHAPES if kind != "planes" for shape in getattr(scene, kind)]
    points += [(np.mean(box, axis=0), float(np.linalg.norm(np.subtract(*box))) / 2) for box in boxes]
    placed = [light for kind in LIGHTS for light in getattr(scene, kind) if hasattr(light, "position")]
    points += [(light.position, getattr(light, "radius", 0.0)) for light in placed]
    points += [(center, radius) for mesh in scene.meshes for center, radius in _bounding_spheres(mesh)]
    return max(float(np.linalg.norm(np.subtract(point, eye))) + radius for point, radius in points)


def _bounding_spheres(mesh: Mesh) -> Iterator[tuple[Matrix, float]]:
    """Centre and radius of a sphere around each part of each instance."""
    for to_world, part in mesh.placed():
        low, high = part.geometry.bounds
        radius = float(np.linalg.norm(to_world[:3, :3], 2) * np.linalg.norm(high - low) / 2)
        yield to_world[:3, :3] @ ((low + high) / 2) + to_world[:3, 3], radius


def plane_radius(scene: Scene, plane: Plane) -> float:
    """Radius of the disk that stands for an infinite plane, in metres.

    10,000 times the scene's size, or more where the camera would still see the rim: seen from height
    h it lies h / radius under the horizon, which must be less than RIM_PIXELS.
    """
    normal = _unit(plane.normal)
    height = abs(float(normal @ np.subtract(scene.camera.position, plane.point)))
    pixel = 2 * np.tan(np.radians(scene.camera.fov_degrees) / 2) / scene.render.height
    return max(1e4 * bounding_radius(scene), float(height / (RIM_PIXELS * pixel)))


TYPES = ("sphere", "disk", "rectangle", "ply")  # of shapes below


def shape(scene: Scene, shape: Any) -> Tree:
    """A shape of ``scene`` that is no triangle."""
    match shape:
        case Plane():
            return plane_disk(scene, shape)
        case Sphere():
            return sphere(shape)
        case Rectangle():
            return rectangle(shape)
        case Disk():
            return disk(shape)
    raise TypeError(f"there is no {type(shape).__name__} in Mitsuba")


def plane_disk(scene: Scene, plane: Plane) -> Tree:
    """A large disk around the point of the plane under the camera."""
    normal = _unit(plane.normal)
    eye = np.asarray(scene.camera.position)
    foot = eye - normal * (normal @ np.subtract(eye, plane.point))
    return disk(Disk(tuple(foot), plane.normal, plane_radius(scene, plane), plane.material))


def rectangle(shape: Rectangle) -> Tree:
    """Mitsuba's rectangle is [-1, 1]² in its xy plane, its front along +z."""
    u, v = np.asarray(shape.edge_u) / 2, np.asarray(shape.edge_v) / 2
    return {"type": "rectangle", "to_world": matrix(u, v, _unit(np.cross(u, v)), shape.corner + u + v)}


def disk(shape: Disk) -> Tree:
    """Mitsuba's disk is the unit disk of its xy plane, its front along +z."""
    scale = np.diag((shape.radius, shape.radius, 1.0, 1.0))
    return {"type": "disk", "to_world": towards(shape.center, shape.normal) @ scale}


def sphere(shape: Sphere) -> Tree:
    """Mitsuba's sphere, its front outside like ours."""
    return {"type": "sphere", "center": list(shape.center), "radius": float(shape.radius)}


def is_ground(scene: Scene, shape: Sphere) -> bool:
    """Whether Mitsuba would shade a sphere by itself near the camera: it meets spheres in float32, except in scalar
    variants, and so knows a point of one to a part of the radius, while rays from there begin in a distance that is
    proportional to 1 m and its coordinates. Near the origin those of 30 m are right, of 60 m not."""
    to_camera = np.subtract(scene.camera.position, shape.center)
    away = float(np.linalg.norm(to_camera))
    nearest = shape.center + to_camera * (shape.radius / away if away else 0.0)
    return bool(shape.radius > max(_NEAR * abs(away - shape.radius), _LARGE * (1 + np.abs(nearest).max())))


def ground(path: Path, scene: Scene, shape: Sphere) -> Tree:
    """A sphere as triangles in a PLY file ``path``, the smaller the nearer to the point below the camera."""
    up = _unit(np.subtract(scene.camera.position, shape.center))
    frame = towards((0, 0, 0), up)[:3, :3]
    count = int(np.ceil(2 * np.pi / _STEP))
    rings = int(np.ceil(np.log(np.pi / _NEAREST) / np.log1p(_STEP)))
    theta = np.geomspace(_NEAREST, np.pi, rings)[:-1, None]
    turns = 2 * np.pi * np.arange(count) / count
    local = np.stack(
        np.broadcast_arrays(np.sin(theta) * np.cos(turns), np.sin(theta) * np.sin(turns), -2 * np.sin(theta / 2) ** 2),
        -1,
    )
    ends = np.array([(0.0, 0.0, 0.0), (0.0, 0.0, -2.0)])
    top = shape.center + shape.radius * up
    points = top + shape.radius * np.concatenate([local.reshape(-1, 3), ends]) @ frame.T
    first = np.arange((rings - 2) * count).reshape(-1, count)
    after, last = np.roll(first, -1, axis=1), (rings - 2) * count
    quads = np.stack([first, first + count, after + count, after], -1).reshape(-1, 4)
    near, far = np.arange(count), last + np.arange(count)
    caps = [
        np.column_stack([np.full(count, last + count), near, np.roll(near, -1)]),
        np.column_stack([np.full(count, last + count + 1), np.roll(far, -1), far]),
    ]
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]], *caps]).astype(np.int32)
    write_ply(path, dict(zip("xyz", points.T, strict=True)), triangles)
    return {"type": "ply", "filename": str(path), "face_normals": True}


def upright_sphere(shape: Tree) -> Tree:
    """The same sphere with its poles, about which Mitsuba's tangents turn, along y."""
    x, y, z = shape["radius"] * np.array([(1.0, 0.0, 0.0), (0.0, 0.0, -1.0), (0.0, 1.0, 0.0)])
    return {"type": "sphere", "to_world": matrix(x, y, z, shape["center"])}


def triangle_mesh(path: Path, vertices: ArrayLike) -> Tree:
    """A mesh of separate triangles in a PLY file.

    Parameters
    ----------
    path
        The file to write.
    vertices
        Shape (triangles, 3, 3), in metres, counter-clockwise from the front.
    """
    points = np.asarray(vertices, np.float64).reshape(-1, 3)
    write_ply(path, dict(zip("xyz", points.T, strict=True)), np.arange(len(points), dtype=np.int32).reshape(-1, 3))
    return {"type": "ply", "filename": str(path), "face_normals": True}


def write_ply(path: Path, columns: Columns, triangles: NDArray[np.int32]) -> None:
    """A binary PLY file of float32 ``columns``, one number for each vertex, and ``triangles`` (n, 3)."""
    vertices = np.empty(len(columns["x"]), [(name, "<f4") for name in columns])
    for name, values in columns.items():
        vertices[name] = values
    faces = np.empty(len(triangles), dtype=[("count", "u1"), ("vertices", "<i4", 3)])
    faces["count"], faces["vertices"] = 3, triangles
    header = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(vertices)}\n"
    header += "".join(f"property float {name}\n" for name in columns)
    header += f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    path.write_bytes(header.encode() + vertices.tobytes() + faces.tobytes())


def _unit(v: ArrayLike) -> NDArray[np.float64]:
    vector = np.asarray(v, dtype=np.float64)
    return vector / float(np.linalg.norm(vector))
