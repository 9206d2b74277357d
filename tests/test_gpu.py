# SPDX-License-Identifier: MIT
"""The graphics driver at its limits: devices that do not work, and memory that runs out."""

from typing import Any

import moderngl
import pytest

from fragtracer.errors import DeviceError
from fragtracer.gpu import context as contexts
from fragtracer.gpu.film import Film


def devices(monkeypatch: pytest.MonkeyPatch, works: int | None, count: int = 3) -> list[int | None]:
    """Have a machine of ``count`` EGL devices of which one works; returns which are tried."""
    tried: list[int | None] = []

    def create(**options: Any) -> str:
        index = options.get("device_index")
        tried.append(index)
        if index is None or index >= count:
            raise Exception(f"requested device index {index}, but found {count} devices")
        if index != works:
            raise Exception(f"eglInitialize failed on device {index}")
        return f"context of {index}"

    monkeypatch.setattr(contexts.sys, "platform", "linux")
    monkeypatch.setattr(contexts.moderngl, "create_context", create)
    monkeypatch.delenv("GLCONTEXT_DEVICE_INDEX", raising=False)
    return tried


def test_a_device_that_does_not_work_is_passed_over(monkeypatch: pytest.MonkeyPatch) -> None:
    tried = devices(monkeypatch, works=2)
    assert contexts.create_context() == "context of 2"
    assert tried == [0, 1, 2]


def test_where_no_device_works_the_reasons_are_given(monkeypatch: pytest.MonkeyPatch) -> None:
    devices(monkeypatch, works=None)
    with pytest.raises(DeviceError, match=r"failed on device 1; .*install"):
        contexts.create_context()


@pytest.mark.parametrize("name", ["99", "first"])
def test_a_device_that_was_asked_for_is_not_replaced(monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    """glcontext itself reads the variable."""
    monkeypatch.setattr(contexts.sys, "platform", "linux")
    monkeypatch.setenv("GLCONTEXT_DEVICE_INDEX", name)
    with pytest.raises(DeviceError, match=f"GLCONTEXT_DEVICE_INDEX is '{name}': unset it"):
        contexts.create_context()


class Scarce:
    """A context whose memory ends after some textures, or before the second framebuffer."""

    def __init__(self, ctx: moderngl.Context, textures: int) -> None:
        self._ctx, self._left = ctx, textures
        self.living: list[Any] = []
        self.error_was_taken = False

    def __getattr__(self, name: str) -> Any:
        return getattr(self._ctx, name)

    @property
    def error(self) -> str:
        self.error_was_taken = True
        return str(self._ctx.error)

    def _made(self, resource: Any) -> Any:
        self.living.append(resource)
        return resource

    def texture(self, *arguments: Any, **options: Any) -> Any:
        if self._left == 0:
            raise moderngl.Error("cannot create texture")
        self._left -= 1
        return self._made(self._ctx.texture(*arguments, **options))

    def framebuffer(self, *arguments: Any) -> Any:
        return self._made(self._ctx.framebuffer(*arguments))


@pytest.mark.parametrize("textures", range(6))
def test_a_film_that_does_not_fit_leaves_nothing_behind(ctx: moderngl.Context, textures: int) -> None:
    scarce: Any = Scarce(ctx, textures)
    with pytest.raises(DeviceError, match="no memory for an image of 8x4"):
        Film(scarce, 8, 4)
    assert len(scarce.living) == textures + textures // 3
    assert all(isinstance(resource.mglo, moderngl.mgl.InvalidObject) for resource in scarce.living)
    assert scarce.error_was_taken
