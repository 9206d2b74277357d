# SPDX-License-Identifier: MIT
"""Models made by the tests, and files by others where there are any."""

import base64
import io
import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import PIL.Image
import pytest

from fragtracer.io import Model, read_model

TRIANGLE = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
SHARED = Path(__file__).parents[3] / "shared" / "data"


def shared(*parts: str) -> Path:
    """A file by others; the test that asks for one is skipped where there is none."""
    path = SHARED.joinpath(*parts)
    if not path.exists():
        pytest.skip(f"there is no shared data {Path(*parts)}")
    return path


def _png() -> bytes:
    file = io.BytesIO()
    PIL.Image.fromarray(np.arange(16, dtype=np.uint8).reshape(2, 2, 4)).save(file, "PNG")
    return file.getvalue()


PNG = _png()  # 2 x 2 pixels, from 0 to 15


class Gltf:
    """Collects the arrays of a glTF document in one buffer; ``others`` come after that."""

    def __init__(self, **content: Any) -> None:
        self.content = {"asset": {"version": "2.0"}, "bufferViews": [], "accessors": [], **content}
        self.data = b""
        self.others: list[dict[str, Any]] = []

    def view(self, data: bytes, stride: int | None = None) -> int:
        self.data += b"\0" * (-len(self.data) % 4)
        view = {"buffer": 0, "byteOffset": len(self.data), "byteLength": len(data)}
        self.content["bufferViews"].append(view | ({"byteStride": stride} if stride else {}))
        self.data += data
        return len(self.content["bufferViews"]) - 1

    def array(self, values: Any, dtype: str = "<f4", **more: Any) -> int:
        array = np.asarray(values, dtype)
        array = array if array.ndim == 2 else array[:, None]
        kind = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4"}[array.shape[1]]
        number = {"<f4": 5126, "<u1": 5121, "<u2": 5123, "<u4": 5125, "<i1": 5120, "<i2": 5122}[dtype]
        view = self.view(array.tobytes())
        accessor = {"bufferView": view, "componentType": number, "count": len(array), "type": kind, **more}
        self.content["accessors"].append(accessor)
        return len(self.content["accessors"]) - 1

    def triangle(self, **primitive: Any) -> None:
        """One triangle in a mesh, a node and a scene of its own."""
        position = self.array(TRIANGLE)
        attributes = {"POSITION": position, **primitive.pop("attributes", {})}
        self.content.setdefault("meshes", []).append({"primitives": [{"attributes": attributes, **primitive}]})
        self.content.setdefault("nodes", [{"mesh": 0}])
        self.content.setdefault("scenes", [{"nodes": [0]}])

    def animation(self, name: str | None, *channels: tuple[int, str, Any, Any, str]) -> None:
        """Each channel is a node, what of it is moved, times, values (keys, width), and an interpolation."""
        samplers, targets = [], []
        for number, (node, path, times, values, interpolation) in enumerate(channels):
            output = self.array(values)
            samplers.append({"input": self.array(times), "output": output, "interpolation": interpolation})
            targets.append({"sampler": number, "target": {"node": node, "path": path}})
        named = {} if name is None else {"name": name}
        self.content.setdefault("animations", []).append(named | {"samplers": samplers, "channels": targets})

    def write(self, path: Path) -> Path:
        if path.suffix == ".glb":
            self.content["buffers"] = [{"byteLength": len(self.data)}, *self.others]
            text = json.dumps(self.content).encode()
            text += b" " * (-len(text) % 4)
            data = self.data + b"\0" * (-len(self.data) % 4)
            header = struct.pack("<4s2I", b"glTF", 2, 12 + 8 + len(text) + 8 + len(data))
            chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(data), b"BIN\0") + data
            path.write_bytes(header + chunks)
        else:
            uri = "data:application/octet-stream;base64," + base64.b64encode(self.data).decode()
            self.content["buffers"] = [{"byteLength": len(self.data), "uri": uri}, *self.others]
            path.write_text(json.dumps(self.content))
        return path

    def read(self, tmp_path: Path, name: str = "x.gltf") -> Model:
        """The model, by way of a file."""
        return read_model(self.write(tmp_path / name))
