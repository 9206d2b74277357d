# SPDX-License-Identifier: MIT
"""A glTF model that two animations move."""

from pathlib import Path

from files.data import Gltf


def model(path: Path, has_camera: bool = True, rise: float = 4) -> Path:
    """A strip one end of which is on a joint that "rise" lifts by 4 m in a second, over a floor, while a lamp goes from
    one side to the other and the camera back; "turn" turns the floor."""
    nodes = [{"mesh": 0, "skin": 0}, {}, {}, {"mesh": 1}, {"extensions": {"KHR_lights_punctual": {"light": 0}}}]
    nodes += [{"camera": 0, "translation": [0, 1, 6]}] if has_camera else []
    gltf = Gltf(
        nodes=nodes,
        scenes=[{"nodes": list(range(len(nodes)))}],
        skins=[{"joints": [1, 2]}],
        cameras=[{"type": "perspective", "perspective": {"yfov": 1, "aspectRatio": 4 / 3}}],
        extensionsUsed=["KHR_lights_punctual"],
        extensions={"KHR_lights_punctual": {"lights": [{"type": "point", "intensity": 30}]}},
        materials=[{"doubleSided": True, "pbrMetallicRoughness": {"metallicFactor": 0}}],
    )
    joints = gltf.array([[0, 0, 0, 0]] * 2 + [[1, 0, 0, 0]] * 2, "<u1")
    held = {"JOINTS_0": joints, "WEIGHTS_0": gltf.array([[1, 0, 0, 0]] * 4)}
    strip = [[-1, 0, 0], [1, 0, 0], [1, 1, 0], [-1, 1, 0]]
    floor = [[-2, -1, -2], [2, -1, -2], [2, -1, 2], [-2, -1, 2]]
    indices = gltf.array([0, 1, 2, 0, 2, 3], "<u2")
    for points, more in ((strip, held), (floor, {})):
        primitive = {"attributes": {"POSITION": gltf.array(points), **more}, "indices": indices, "material": 0}
        gltf.content.setdefault("meshes", []).append({"primitives": [primitive]})
    moves = [(2, "translation", [0, 1], [[0, 0, 0], [0, rise, 0]], "LINEAR")]
    moves += [(4, "translation", [0, 1], [[3, 3, 3], [-3, 3, 3]], "LINEAR")]
    moves += [(5, "translation", [0, 1], [[0, 1, 6], [0, 1, 12]], "LINEAR")] if has_camera else []
    gltf.animation("rise", *moves)
    gltf.animation("turn", (3, "rotation", [0, 0.5], [[0, 0, 0, 1], [0, 1, 0, 0]], "STEP"))
    return gltf.write(path)
