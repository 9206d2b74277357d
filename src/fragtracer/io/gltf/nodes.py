# SPDX-License-Identifier: MIT
"""The node hierarchy of a glTF scene (section 3.5), with world matrices."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from fragtracer.io.gltf import document as gltf
from fragtracer.io.gltf.container import Container
from fragtracer.scene.fields import LARGEST

Matrix = NDArray[np.float64]
_LAST_ROW = (0, 0, 0, 1)
PlacedNode = tuple[int, gltf.Node, Matrix]


def placed_nodes(container: Container, nodes: list[gltf.Node]) -> Iterator[PlacedNode]:
    """Index, node and (4, 4) world matrix of all nodes of the default scene; ``nodes`` are those of the document, in
    any pose.

    Raises SceneError if a node does not exist or has two parents, as in a cycle.
    """
    document = container.document
    if document.scenes:
        shown: gltf.Scene = container.item(document.scenes, document.scene or 0, "scene")
        roots = shown.nodes
    else:
        children = {child for node in nodes for child in node.children}
        roots = [index for index in range(len(nodes)) if index not in children]
    waiting = [(index, np.eye(4)) for index in reversed(roots)]
    met = set()
    while waiting:
        index, above = waiting.pop()
        node: gltf.Node = container.item(nodes, index, "nodes")
        if index in met:
            raise container.error(f"nodes[{index}]", "has two parents, or is its own ancestor")
        met.add(index)
        local = local_matrix(node)
        if not np.allclose(local[3], _LAST_ROW, atol=1e-6):
            raise container.error(f"nodes[{index}].matrix", "the last of each four numbers must be 0, 0, 0 and 1")
        local[3] = _LAST_ROW
        with np.errstate(over="ignore", invalid="ignore"):
            matrix = above @ local
        if not np.abs(matrix).max() <= LARGEST:
            raise container.error(f"nodes[{index}]", "its world matrix overflows")
        yield index, node, matrix
        waiting += [(child, matrix) for child in reversed(node.children)]


def local_matrix(node: gltf.Node) -> Matrix:
    """(4, 4) matrix from the node to its parent."""
    if node.matrix is not None:
        return np.array(node.matrix).reshape(4, 4).T
    places = (np.array([values], np.float64) for values in (node.translation, node.rotation, node.scale))
    found: Matrix = local_matrices(*places)[0]
    return found


def local_matrices(translations: Matrix, rotations: Matrix, scales: Matrix) -> Matrix:
    """(n, 4, 4) matrices of (n, 3) translations, (n, 4) quaternions, xyzw and of any length, and (n, 3) scales."""
    lengths = np.linalg.norm(rotations, axis=1, keepdims=True)
    x, y, z, w = (rotations / np.where(lengths > 0, lengths, 1)).T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    matrices = np.tile(np.eye(4), (len(translations), 1, 1))
    matrices[:, :3, :3] = np.moveaxis(np.array(rows), -1, 0) * scales[:, None, :]
    matrices[:, :3, 3] = translations
    return matrices
