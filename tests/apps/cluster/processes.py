# SPDX-License-Identifier: MIT
"""Schedulers and workers as users start them, and a network between them that stalls."""

import json
import os
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path


@contextmanager
def dask(program: str, *arguments: object, **environment: str) -> Iterator[subprocess.Popen[bytes]]:
    """A process of Dask, killed at the end."""
    command = [sys.executable, "-m", f"distributed.cli.dask_{program}", "--dashboard-address", ":0"]
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    with subprocess.Popen([*command, *map(str, arguments)], env=os.environ | environment, **quiet) as process:
        try:
            yield process
        finally:
            process.kill()


@contextmanager
def scheduler(file: Path, host: str = "127.0.0.1", **environment: str) -> Iterator[tuple[subprocess.Popen[bytes], str]]:
    """With its address, which it writes to ``file``."""
    with dask("scheduler", "--scheduler-file", file, "--host", host, "--port", 0, **environment) as process:
        while not file.exists() or not file.read_text():
            assert process.poll() is None
            time.sleep(0.05)
        yield process, json.loads(file.read_text())["address"]


@contextmanager
def worker(address: str, *arguments: object, **environment: str) -> Iterator[subprocess.Popen[bytes]]:
    with dask("worker", address, "--nthreads", 1, "--no-nanny", *arguments, **environment) as process:
        yield process


def free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as server:
        return int(server.getsockname()[1])


class Network:
    """Forwards connections to ports of this machine, until it stalls: they stay open, but nothing comes through."""

    def __init__(self) -> None:
        self.flows = threading.Event()
        self.flows.set()
        self._sockets: list[socket.socket] = []

    def address_of(self, port: int) -> str:
        """Of what leads to ``port``."""
        server = socket.create_server(("127.0.0.1", 0))
        self._sockets.append(server)
        threading.Thread(target=self._accept, args=(server, port), daemon=True).start()
        return f"tcp://127.0.0.1:{server.getsockname()[1]}"

    def close(self) -> None:
        self.flows.set()
        for end in self._sockets:
            with suppress(OSError):
                end.shutdown(socket.SHUT_RDWR)
            end.close()

    def _accept(self, server: socket.socket, port: int) -> None:
        with suppress(OSError):
            while True:
                near, _ = server.accept()
                far = socket.create_connection(("127.0.0.1", port))
                self._sockets += [near, far]
                for ends in ((near, far), (far, near)):
                    threading.Thread(target=self._forward, args=ends, daemon=True).start()

    def _forward(self, source: socket.socket, sink: socket.socket) -> None:
        with suppress(OSError):
            while data := source.recv(1 << 16):
                self.flows.wait()
                sink.sendall(data)
        with suppress(OSError):
            sink.shutdown(socket.SHUT_RDWR)
