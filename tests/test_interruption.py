# SPDX-License-Identifier: MIT
"""Signals that come at a bad time."""

import signal
import subprocess
import sys
import threading
from collections.abc import Iterator

import moderngl
import pytest

from fragtracer import interruption
from fragtracer.gpu.program import FullscreenProgram
from fragtracer.resources import folder


@pytest.fixture(autouse=True)
def _ctrl_c() -> Iterator[None]:
    """Whoever runs the tests in the background may have them ignore Ctrl-C."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.parametrize("fails", [False, True])
def test_a_deferred_signal_comes_after_the_block(fails: bool) -> None:
    def work() -> None:
        with interruption.deferred():
            signal.raise_signal(signal.SIGINT)
            signal.raise_signal(signal.SIGINT)
            done.append(1)
            if fails:
                raise ValueError

    done: list[int] = []
    with pytest.raises(KeyboardInterrupt):
        work()
    assert done
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_other_threads_defer_nothing() -> None:
    def work() -> None:
        with interruption.deferred():
            done.append(signal.getsignal(signal.SIGINT))

    done: list[object] = []
    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert done == [signal.default_int_handler]


def test_only_the_first_signal_interrupts() -> None:
    done = []
    with interruption.once():
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
        with interruption.deferred():
            signal.raise_signal(signal.SIGINT)
        signal.raise_signal(signal.SIGINT)
        done.append(1)
    assert done
    with pytest.raises(KeyboardInterrupt):
        signal.raise_signal(signal.SIGINT)


@pytest.mark.skipif(sys.platform == "win32", reason="there Ctrl-C reaches all processes of a terminal")
def test_ctrl_c_reaches_no_child() -> None:
    said = []

    def ask() -> None:
        code = "import signal; print(int(signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, [])))"
        said.append(subprocess.run([sys.executable, "-ISc", code], capture_output=True, text=True, check=True).stdout)

    thread = threading.Thread(target=ask)
    with interruption.children_uninterrupted():
        thread.start()
    thread.join()
    assert said == ["1\n"]
    assert signal.SIGINT not in signal.pthread_sigmask(signal.SIG_BLOCK, [])


def test_a_driver_compiles_to_the_end(ctx: moderngl.Context, monkeypatch: pytest.MonkeyPatch) -> None:
    """The C code of moderngl calls Python while it does, and an exception there ends the process."""
    compiled = []

    def program(**texts: str) -> moderngl.Program:
        signal.raise_signal(signal.SIGINT)
        compiled.append(moderngl.Context.program(ctx, **texts))
        return compiled[0]

    monkeypatch.setattr(ctx, "program", program, raising=False)
    with pytest.raises(KeyboardInterrupt):
        FullscreenProgram(ctx, folder("shaders"), "film/gather.frag")
    assert compiled
    compiled[0].release()
