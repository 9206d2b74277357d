# SPDX-License-Identifier: MIT
"""Standard output and error that do not stop the work when they cannot be written."""

import io
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any


class _Lossy(io.RawIOBase):
    """Loses what ``raw`` cannot write; ``error`` is the first that it met."""

    def __init__(self, raw: Any) -> None:
        self._raw = raw
        self.error: OSError | None = None

    def writable(self) -> bool:
        return True

    def isatty(self) -> bool:
        return bool(self._raw.isatty())

    def fileno(self) -> int:
        return int(self._raw.fileno())

    def write(self, data: Any) -> int | None:
        try:
            written: int | None = self._raw.write(data)
        except OSError as error:
            self.error = self.error or error
            return len(data)
        return written


@contextmanager
def lossy(name: str) -> Iterator[_Lossy]:
    """Have ``sys.stdout`` or ``sys.stderr`` lose what cannot be written, and escape what it has no characters for: not
    all know minus signs, or the names of all files."""
    stream = getattr(sys, name)
    encoding, lines = "utf-8", True
    if stream is None:  # it is closed: nothing else shall get its number, and writing to it fails
        raw: Any = io.FileIO(os.open(os.devnull, os.O_RDONLY), "w", closefd=False)
    elif isinstance(stream, io.TextIOWrapper):
        raw = getattr(stream.buffer, "raw", stream.buffer)
        encoding, lines = stream.encoding, stream.line_buffering or stream.write_through
    else:
        yield _Lossy(stream)
        return
    shown = _Lossy(raw)
    text = io.TextIOWrapper(io.BufferedWriter(shown), encoding, "backslashreplace", line_buffering=lines)
    setattr(sys, name, text)
    try:
        yield shown
    finally:
        text.flush()
        setattr(sys, name, stream)
