# SPDX-License-Identifier: MIT
"""The container of a glTF model: its JSON, and buffers in the binary chunk of a .glb, in data URIs or in files."""

import base64
import binascii
import json
import os
import re
import struct
from collections.abc import Collection
from pathlib import Path
from typing import Any, TypeVar
from urllib.parse import unquote, unquote_to_bytes

from pydantic import ValidationError

from fragtracer.errors import SceneError
from fragtracer.io.gltf import document as gltf
from fragtracer.io.gltf import meshopt
from fragtracer.io.gltf.document import Document, Item, first_mistake
from fragtracer.io.model import read_file

T = TypeVar("T", bound=Item)
_JSON, _BIN = 0x4E4F534A, 0x004E4942
_MOST_BYTES = 2**32  # of all buffer views that are compressed


class Container:
    """A glTF file and its buffers. ``files`` are all files that were read.

    Raises SceneError, with the file and the place in it, if they cannot be read, or if the model needs an extension
    that is not ``supported``.
    """

    def __init__(self, path: Path, supported: Collection[str]) -> None:
        self.path = path
        self.files = [path]
        data = read_file(path)
        text: bytes | memoryview = data
        self._chunk: memoryview | None = None
        if data[:4] == b"glTF" or path.suffix.lower() == ".glb":
            text, self._chunk = _chunks(data, path)
        self.document = _parse(text, path)
        unknown = [name for name in self.document.extensionsRequired if name not in supported]
        if unknown:
            raise SceneError(f"{path}: this model needs {', '.join(unknown)}, which is not supported; save it without")
        self._fetched: dict[str, bytes] = {}
        self._decompressed: dict[int, bytes] = {}
        self._decompressed_size = 0
        self._buffers = [None if self._is_fallback(i) else self._buffer(i) for i in range(len(self.document.buffers))]

    def error(self, place: str, problem: str) -> SceneError:
        """The error to raise for a ``problem`` at ``place`` in the document."""
        return SceneError(f"{self.path}: {place}: {problem}")

    def item(self, items: list[Any], index: int, place: str) -> Any:
        """``items[index]``. Raises SceneError if it does not exist."""
        if index >= len(items):
            raise self.error(place, f"there is no number {index}, only {len(items)} of them")
        return items[index]

    def extension(self, cls: type[T], item: Item, name: str, place: str) -> T | None:
        """The extension ``name`` of ``item``, as a ``cls``; None if it has none."""
        if name not in item.extensions:
            return None
        try:
            return cls.model_validate(item.extensions[name])
        except ValidationError as error:
            raise self.error(f"{place}.extensions.{name}", first_mistake(error)) from error

    def view(self, index: int, place: str) -> memoryview:
        """The bytes of a buffer view."""
        view = self.item(self.document.bufferViews, index, place)
        where = f"bufferViews[{index}]"
        for name in meshopt.EXTENSIONS:
            found = self.extension(gltf.Meshopt, view, name, where)
            if found is not None and (meshopt.is_installed() or not self._is_there(view)):
                return self._view_decompressed(index, found, f"{where}.extensions.{name}")
        return self._slice(view, where)

    def _slice(self, view: gltf.BufferView | gltf.Meshopt, where: str) -> memoryview:
        buffer = self.item(self._buffers, view.buffer, f"{where}.buffer")
        if buffer is None:
            buffer = self._buffers[view.buffer] = self._buffer(view.buffer)
        if view.byteOffset + view.byteLength > len(buffer):
            raise self.error(where, f"ends behind its buffer, which has {len(buffer)} bytes")
        return memoryview(buffer)[view.byteOffset : view.byteOffset + view.byteLength]

    def _view_decompressed(self, index: int, found: gltf.Meshopt, place: str) -> memoryview:
        if index not in self._decompressed:
            size, expected = found.count * found.byteStride, self.document.bufferViews[index].byteLength
            if size != expected:
                elements = f"{found.count} elements of {found.byteStride} bytes"
                raise self.error(place, f"{elements} are not the {expected} of its view")
            self._decompressed_size += size
            if self._decompressed_size > _MOST_BYTES:
                raise self.error(place, f"with it all that is decompressed takes more than {_MOST_BYTES} bytes")
            try:
                self._decompressed[index] = meshopt.decompress(self._slice(found, place), found)
            except ValueError as error:
                raise self.error(place, str(error)) from error
        return memoryview(self._decompressed[index])

    def _is_fallback(self, index: int) -> bool:
        """Whether a buffer is for readers alone that know no compression."""
        buffer, place = self.document.buffers[index], f"buffers[{index}]"
        marks = (self.extension(gltf.MeshoptBuffer, buffer, name, place) for name in meshopt.EXTENSIONS)
        return any(mark is not None and mark.fallback for mark in marks)

    def _is_there(self, view: gltf.BufferView) -> bool:
        """Whether what a compressed ``view`` holds is there uncompressed as well."""
        buffers = self.document.buffers
        return view.buffer < len(buffers) and not (self._is_fallback(view.buffer) and buffers[view.buffer].uri is None)

    def fetch(self, uri: str, place: str) -> bytes:
        """The content of a data URI or of a file relative to the model, each read once."""
        if uri not in self._fetched:
            self._fetched[uri] = self._data(uri, place) if uri.startswith("data:") else self._file(uri, place)
        return self._fetched[uri]

    def _file(self, uri: str, place: str) -> bytes:
        try:
            return read_file(self.beside(uri, place))
        except SceneError as error:
            if str(error).startswith(f"{self.path}: "):
                raise
            raise self.error(place, f"{uri[:60]}: {str(error).rpartition(': ')[2]}") from error

    def beside(self, uri: str, place: str) -> Path:
        """The path of a relative URI."""
        if re.match(r"[a-zA-Z][a-zA-Z0-9+.-]+:", uri) or uri.startswith(("/", "\\")):
            raise self.error(place, f"only files relative to the model are read, not {uri[:60]!r}")
        path = Path(os.path.abspath(self.path.parent / unquote(uri)))
        self.files.append(path)
        return path

    def _data(self, uri: str, place: str) -> bytes:
        kind, comma, content = uri.partition(",")
        if not comma:
            raise self.error(place, "the data URI has no data")
        if not kind.endswith(";base64"):
            return unquote_to_bytes(content)
        try:
            return base64.b64decode(unquote(content), validate=True)
        except (binascii.Error, ValueError) as error:
            raise self.error(place, f"the data URI is not base64: {error}") from error

    def _buffer(self, index: int) -> bytes | memoryview:
        buffer, place = self.document.buffers[index], f"buffers[{index}]"
        if buffer.uri is None:
            if self._chunk is None or index > 0:
                raise self.error(place, "has no uri, and there is no binary chunk for it")
            data: bytes | memoryview = self._chunk
        else:
            data = self.fetch(buffer.uri, f"{place}.uri")
        if len(data) < buffer.byteLength:
            raise self.error(place, f"byteLength is {buffer.byteLength}, but there are only {len(data)} bytes")
        return data


def _parse(text: bytes | memoryview, path: Path) -> Document:
    try:
        found = json.loads(bytes(text).decode("utf-8-sig"))
    except UnicodeDecodeError as error:
        raise SceneError(f"{path}: not UTF-8 text at byte {error.start}") from error
    except RecursionError as error:
        raise SceneError(f"{path}: nested too deeply to be read") from error
    except ValueError as error:
        raise SceneError(f"{path}: not JSON: {error}") from error
    if not isinstance(found, dict):
        raise SceneError(f"{path}: a glTF document is a JSON object, not {type(found).__name__}")
    asset = found.get("asset")
    if isinstance(asset, dict):
        version, least = asset.get("version"), asset.get("minVersion", "2.0")
        if isinstance(version, str) and not version.startswith("2."):
            raise SceneError(f"{path}: this is glTF {version[:20]}; only 2.0 is read")
        if isinstance(least, str) and least != "2.0":
            raise SceneError(f"{path}: asset.minVersion: it wants readers of glTF {least[:20]}; this one is of 2.0")
    try:
        return Document.model_validate(found)
    except ValidationError as error:
        raise SceneError(f"{path}: {first_mistake(error)}") from error


def _chunks(data: bytes, path: Path) -> tuple[memoryview, memoryview | None]:
    """The JSON and the binary chunk of a .glb file (glTF 2.0, section 4.4)."""
    if len(data) < 12 or data[:4] != b"glTF":
        raise SceneError(f"{path}: this is not a .glb file: its header is missing")
    _, version, length = struct.unpack_from("<3I", data)
    if version != 2:
        raise SceneError(f"{path}: this is version {version} of the .glb format; only 2 is read")
    if length > len(data):
        raise SceneError(f"{path}: the header says {length} bytes, but the file has {len(data)}; it was cut off")
    chunks: dict[int, memoryview] = {}
    at, first = 12, None
    while at + 8 <= length:
        size, kind = struct.unpack_from("<2I", data, at)
        if at + 8 + size > length:
            raise SceneError(f"{path}: a chunk of {size} bytes ends behind the file")
        chunks.setdefault(kind, memoryview(data)[at + 8 : at + 8 + size])
        first = kind if first is None else first
        at += 8 + size
    if first != _JSON:
        raise SceneError(f"{path}: the first chunk of this .glb file is not its JSON")
    return chunks[_JSON], chunks.get(_BIN)
