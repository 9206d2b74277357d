# SPDX-License-Identifier: MIT
"""Chooses the Mitsuba variant, and finds the LLVM library that the fast one needs.

Dr.Jit aborts the whole process with LLVM 15 (and refuses older ones), so no library is loaded here
before a child process has asked for its version.
"""

import glob
import os
import re
import subprocess
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from functools import lru_cache

from fragtracer.errors import FragtracerError
from fragtracer.interruption import deferred

OLDEST_LLVM = 16

# Where Debian and Ubuntu, Fedora, Arch, Homebrew, conda and the Windows installer put it.
_FOLDERS = (
    "/usr/lib/*-linux-gnu",
    "/usr/lib/llvm-*/lib",
    "/usr/lib64",
    "/usr/lib64/llvm*/lib*",
    "/usr/lib",
    "/usr/lib/llvm*/lib*",
    "/usr/local/lib",
    "/opt/homebrew/opt/llvm*/lib",
    "/usr/local/opt/llvm*/lib",
    f"{sys.prefix}/lib",
    "C:/Program Files/LLVM/bin",
)
_NAMES = ("libLLVM.so*", "libLLVM-*.so*", "libLLVM*.dylib", "LLVM-C.dll")

# LLVMGetVersion came with LLVM 16; that it is missing says enough.
_ASK_VERSION = """
import ctypes, sys
version = [ctypes.c_uint() for _ in range(3)]
ctypes.CDLL(sys.argv[1]).LLVMGetVersion(*map(ctypes.byref, version))
print(version[0].value)
"""


@lru_cache
def llvm_version(library: str) -> int | None:
    """Major version of an LLVM library; None if it is older than 16 or cannot be loaded."""
    command = [sys.executable, "-I", "-S", "-c", _ASK_VERSION, library]
    try:
        answer = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    except (OSError, subprocess.TimeoutExpired):
        return None
    return int(answer.stdout) if answer.returncode == 0 else None


def _candidates() -> list[str]:
    """LLVM libraries of this machine, each once, the newest names first and unnumbered names last."""
    found = [path for folder in _FOLDERS for name in _NAMES for path in sorted(glob.glob(f"{folder}/{name}"))]

    def named_version(path: str) -> int:
        numbers = re.findall(r"llvm[^0-9]*(\d+)", os.path.realpath(path), flags=re.IGNORECASE)
        return max(map(int, numbers), default=0)

    unique = {os.path.realpath(path): path for path in found}
    newest_first = sorted(unique.values(), key=named_version, reverse=True)
    return [path for path in newest_first if not 0 < named_version(path) < OLDEST_LLVM]


@lru_cache
def find_llvm() -> str | None:
    """Path of an LLVM library of version 16 or newer, that of ``DRJIT_LIBLLVM_PATH`` if it is one, or None."""
    asked = os.environ.get("DRJIT_LIBLLVM_PATH")
    if asked:
        if (llvm_version(asked) or 0) >= OLDEST_LLVM:
            return asked
        warnings.warn(f"DRJIT_LIBLLVM_PATH={asked} is not LLVM {OLDEST_LLVM} or newer; looking elsewhere", stacklevel=2)
    return next((path for path in _candidates() if (llvm_version(path) or 0) >= OLDEST_LLVM), None)


def choose_variant(variant: str | None = None) -> str:
    """The Mitsuba variant to use, with the environment prepared for it.

    Parameters
    ----------
    variant
        "llvm_ad_rgb", "cuda_ad_rgb" or "scalar_rgb". None takes LLVM if there is one, and otherwise
        ``scalar_rgb`` with a warning.

    Raises
    ------
    FragtracerError
        If the variant is not one of linear RGB, or needs an LLVM library that is not there.
    """
    if variant is not None and not variant.endswith("_rgb"):
        raise FragtracerError(f"Mitsuba variant {variant!r} does not work in linear RGB; use llvm_ad_rgb")
    if variant is not None and not variant.startswith("llvm"):
        return variant
    library = find_llvm()
    if library is not None:
        os.environ["DRJIT_LIBLLVM_PATH"] = library
        return variant or "llvm_ad_rgb"
    advice = f"install LLVM {OLDEST_LLVM} or newer, or set DRJIT_LIBLLVM_PATH to its shared library"
    if variant is not None:
        raise FragtracerError(f"Mitsuba's {variant} found no LLVM library that it can use; {advice}")
    warnings.warn(f"no usable LLVM library: Mitsuba runs as scalar_rgb, about 60 times slower; {advice}", stacklevel=2)
    return "scalar_rgb"


@contextmanager
def mitsuba_variant(variant: str | None = None) -> Iterator[str]:
    """Runs a block with Mitsuba in ``variant`` (see :func:`choose_variant`) and gives the variant's name.

    fragtracer's material is registered; the variant that was active before comes back afterwards.

    Raises
    ------
    FragtracerError
        If Mitsuba is not installed, or the variant does not start on this machine.
    """
    name = choose_variant(variant)
    with deferred():
        try:
            import mitsuba as mi
        except ImportError as error:
            raise FragtracerError("Mitsuba is not installed; pip install 'fragtracer[reference]'") from error
        before = mi.variant()
        try:
            mi.set_variant(name)
        except (ImportError, AttributeError) as error:
            raise FragtracerError(f"Mitsuba's variant {name!r} does not start here: {error}") from error
        from fragtracer.reference.plugins import register

        register()
    try:
        yield name
    finally:
        if before:
            mi.set_variant(before)
