# SPDX-License-Identifier: MIT
"""The header and the elements of a PLY file, checked against its size before memory is allocated."""

import re
import struct
import warnings
from array import array
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fragtracer.io.model import text_of

Ints = NDArray[np.int64]
_TYPES = {"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4"}
_TYPES |= {"int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4"}
_TYPES |= {"float": "f4", "float32": "f4", "double": "f8", "float64": "f8"}
_CODES = {"i1": "b", "u1": "B", "i2": "h", "u2": "H", "i4": "i", "u4": "I"}  # of numpy types, for struct
_FORMATS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}


@dataclass(frozen=True)
class Property:
    """A property of numpy type ``type``; ``count`` is the type of the length of a list, None for a scalar."""

    name: str
    type: str
    count: str | None = None


@dataclass
class Element:
    name: str
    count: int
    properties: list[Property] = field(default_factory=list)


@dataclass
class Header:
    """``format`` is "" for ASCII, otherwise the byte order, as numpy has it."""

    format: str
    elements: list[Element]
    comments: list[str]


@dataclass
class Table:
    """The data of one element: a column for each scalar, and for each list its (rows,) lengths and flattened values."""

    columns: dict[str, NDArray[Any]]
    lists: dict[str, tuple[Ints, NDArray[Any]]]


def read_header(data: bytes) -> tuple[Header, NDArray[Any]]:
    """The header and the body: bytes, or numbers if the file is ASCII.

    Raises ValueError with a message for the user.
    """
    end = re.search(rb"(?:^|\n|\r)end_header[ \t]*(?:\r\n|\n|\r|$)", data)
    if not re.match(rb"ply\s", data) or not end:
        raise ValueError("this is not a PLY file: it does not open with ply or its header does not end with end_header")
    header = Header("?", [], [])
    for line in re.split(r"\r\n|\n|\r", text_of(data[: end.start()]))[1:]:
        words = line.split()
        match words:
            case ["format", kind, *_] if kind in _FORMATS:
                header.format = _FORMATS[kind]
            case ["comment" | "obj_info", *_]:
                header.comments.append(line.partition(" ")[2].strip())
            case ["element", name, count] if re.fullmatch(r"\d{1,18}", count):
                header.elements.append(Element(name, int(count)))
            case ["property", kind, name] if kind in _TYPES and header.elements:
                header.elements[-1].properties.append(Property(name, _TYPES[kind]))
            case ["property", "list", count, kind, name] if {count, kind} <= _TYPES.keys() and header.elements:
                if _TYPES[count][0] == "f":
                    raise ValueError(
                        f"the header gives the length of the list {name} a floating-point type: {line.strip()[:60]}"
                    )
                header.elements[-1].properties.append(Property(name, _TYPES[kind], _TYPES[count]))
            case []:
                pass
            case _:
                raise ValueError(f"the header has a line that cannot be read: {line.strip()[:60]!r}")
    if header.format == "?":
        raise ValueError("the header does not say whether the file is ascii or binary")
    for element in header.elements:
        names = [p.name for p in element.properties]
        if len({*names}) < len(names) or not names:
            raise ValueError(f"the header gives {element.name} a property twice, or none")
    body = data[end.end() :]
    return header, np.frombuffer(body, np.uint8) if header.format else _ascii(body)


def _ascii(body: bytes) -> NDArray[np.float64]:
    with warnings.catch_warnings():
        warnings.simplefilter("error", DeprecationWarning)
        try:
            return np.fromstring(body.strip().decode("latin-1"), np.float64, sep=" ")
        except (DeprecationWarning, ValueError):
            raise ValueError("there is something else than numbers behind the header") from None


def read_table(order: str, element: Element, body: NDArray[Any]) -> tuple[Table, NDArray[Any]]:
    """The data of ``element``, at the beginning of ``body``, and the rest of ``body``. Raises ValueError."""
    width = [1 if not order else np.dtype(p.count or p.type).itemsize for p in element.properties]
    if element.count * sum(width) > len(body):
        raise ValueError(f"the header claims {element.count} of {element.name}, more than the file has room for")
    return _read_equal(order, element, body) or _read_rows(order, element, body)


def _read_equal(order: str, element: Element, body: NDArray[Any]) -> tuple[Table, NDArray[Any]] | None:
    """The data if all rows have lists of the lengths of the first row, otherwise None."""
    if not element.count:
        return _read_rows(order, element, body)
    lengths = [int(length[0]) for length in _scan(order, element, body, 1)[1]]
    fields: list[Any] = []
    for index, (p, length) in enumerate(zip(element.properties, lengths, strict=True)):
        if p.count:
            fields.append((f"n{index}", order + p.count if order else "f8"))
        fields.append((f"p{index}", order + p.type if order else "f8", (length,) if p.count else ()))
    row = np.dtype(fields)
    size = element.count * row.itemsize // (1 if order else 8)
    if size > len(body):
        return None
    rows = np.ascontiguousarray(body[:size]).view(row)
    table = Table({}, {})
    for index, (p, length) in enumerate(zip(element.properties, lengths, strict=True)):
        values = _typed(rows[f"p{index}"], p)
        if p.count and (rows[f"n{index}"] != length).any():
            return None
        if p.count:
            table.lists[p.name] = np.full(element.count, length), values.reshape(-1)
        else:
            table.columns[p.name] = values
    return table, body[size:]


def _scan(order: str, element: Element, body: NDArray[Any], rows: int) -> tuple[list[Ints], list[Ints]]:
    """The (rows,) offsets of the values of each property in the first ``rows`` rows, and their numbers."""
    offsets, lengths = ([array("q") for _ in element.properties] for _ in range(2))
    columns = []
    for index, p in enumerate(element.properties):
        count = struct.Struct(f"{order}{_CODES[p.count]}") if p.count and order else None
        item, head = int(p.type[1]) if order else 1, count.size if count else int(p.count is not None)
        columns.append((p.name, item, head, count, offsets[index].append, lengths[index].append))
    ends = f"the file ends within the {element.name} that its header claims"
    data, at = memoryview(body.data), 0
    for _ in range(rows):
        for name, item, head, count, add_offset, add_length in columns:
            start = at + head
            length: float = 1
            if head and start <= len(data):
                length = data[at] if count is None else count.unpack_from(data, at)[0]
            if not 0 <= length * item <= len(data) - start or length != int(length):
                raise ValueError(f"a list of {name} is longer than the rest of the file" if head else ends)
            add_offset(start)
            add_length(int(length))
            at = start + int(length) * item
    return [np.array(item, np.int64) for item in offsets], [np.array(item, np.int64) for item in lengths]


def _read_rows(order: str, element: Element, body: NDArray[Any]) -> tuple[Table, NDArray[Any]]:
    """The data, row by row."""
    offsets, lengths = _scan(order, element, body, element.count)
    table, end = Table({}, {}), 0
    for p, starts, counts in zip(element.properties, offsets, lengths, strict=True):
        sizes = counts * int(p.type[1]) if order else counts
        gathered = _gathered(body, starts, sizes)
        values = _typed(gathered.view(order + p.type) if order else gathered, p)
        if p.count:
            table.lists[p.name] = counts, values
        else:
            table.columns[p.name] = values
        end = int(starts[-1] + sizes[-1]) if element.count else 0
    return table, body[end:]


def _gathered(body: NDArray[Any], starts: Ints, sizes: Ints) -> NDArray[Any]:
    """The slices of ``body`` of these starts and sizes, one after the other."""
    before = np.cumsum(sizes) - sizes
    gathered: NDArray[Any] = body[np.repeat(starts - before, sizes) + np.arange(sizes.sum())]
    return gathered


def _typed(values: NDArray[Any], p: Property) -> NDArray[Any]:
    """The values in the type of the header and the byte order of this machine."""
    if p.count and p.type[0] != "f":
        if values.dtype.kind == "f" and not ((np.abs(values) < 2**62) & (values == np.rint(values))).all():
            raise ValueError(f"{p.name} must hold whole numbers")
        return np.asarray(values, np.int64)
    if values.dtype.kind == "f" and p.type[0] != "f":
        info = np.iinfo(p.type)
        return np.asarray(np.nan_to_num(np.clip(values, info.min, info.max)), p.type)
    return np.asarray(values, values.dtype.newbyteorder("="))
