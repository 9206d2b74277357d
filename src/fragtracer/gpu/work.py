# SPDX-License-Identifier: MIT
"""Films whose texels are not the pixels of an image: lists of work, windows, and what is made of them."""

from collections.abc import Iterator

import moderngl
import numpy as np
from numpy.typing import NDArray

from fragtracer.errors import DeviceError
from fragtracer.gpu.context import nearest_texture
from fragtracer.gpu.film import Film, read_pixels
from fragtracer.gpu.outputs import Outputs
from fragtracer.gpu.program import FullscreenProgram
from fragtracer.gpu.tracer import Tracer
from fragtracer.sampling import gradients
from fragtracer.sampling.allocation import BLOCK, Window, WorkList
from fragtracer.sampling.pixels import Floats, Pixels

_LIST_WIDTH = 1024  # texels of a list of work; items stand in blocks of 4 x 4, as film/gather.frag reads them
_GATHERED = 100_000  # pixels in a draw that gathers


def work_texture(ctx: moderngl.Context, image_height: int, window: Window) -> moderngl.Texture:
    """Film texels as items of a list, each of its pixel in the window (film/work.glsl).

    Raises :class:`DeviceError` if the GPU cannot hold it."""
    x, y = np.arange(window.width), image_height - window.top - window.height + np.arange(window.height)
    texels = np.empty((window.height, window.width, 2), np.uint32)
    texels[..., 0] = y[:, None] << 16 | x + window.left
    texels[..., 1] = window.first_sample
    return _listed(ctx, texels)


class Tilings:
    """An image twice: below, samples that take the random numbers of aligned blocks of pixels, and above it of shifted
    ones (:mod:`fragtracer.sampling.gradients`). Raises :class:`DeviceError` if the GPU cannot hold it."""

    def __init__(self, ctx: moderngl.Context, width: int, height: int) -> None:
        self.film = Film(ctx, width, 2 * height)
        texels = np.zeros((2, height, width, 2), np.uint32)
        texels[..., 0] = np.arange(height)[:, None] << 16 | np.arange(width)
        texels[..., 0] |= np.array([gradients.ALIGNED, gradients.SHIFTED], np.uint32)[:, None, None]
        try:
            self.work = _listed(ctx, texels.reshape(2 * height, width, 2))
        except DeviceError:
            self.film.release()
            raise

    @property
    def gpu_bytes(self) -> int:
        """Size of all textures."""
        width, height = self.film.size
        return self.film.gpu_bytes + 8 * width * height

    def release(self) -> None:
        self.film.release()
        self.work.release()


class ItemList:
    """A list of work and its film, of up to ``most`` items in blocks of 4 x 4 texels, for the pixels of a window of an
    image of ``image_height`` pixels."""

    def __init__(self, ctx: moderngl.Context, image_height: int, window: Window, most: int) -> None:
        self._ctx = ctx
        self.film = Film(ctx, _LIST_WIDTH, _rows(most))
        y, x = np.ogrid[: window.height, : window.width]
        place = (image_height - 1 - window.top - y) << 16 | x + window.left
        self._places = place.ravel().astype(np.uint32)  # of the pixels of the window in the image

    def trace(self, tracer: Tracer, work: WorkList, stage: int, rays: int, budget: float | None) -> Iterator[float]:
        """Sample the items, ``rays`` times each; yields the share that is done."""
        items = len(work.pixels)
        width, rows = _LIST_WIDTH, _rows(items)
        texels = np.zeros((rows * width, 2), np.uint32)
        texels[:items, 0] = self._places[work.pixels]
        if work.numbers is not None:
            texels[:items, 0] |= work.numbers
        texels[:items, 1] = work.first
        blocks = texels.reshape(rows // BLOCK, width // BLOCK, BLOCK, BLOCK, 2).swapaxes(1, 2)
        texture = _listed(self._ctx, blocks.reshape(rows, width, 2))
        self.film.clear()
        self.film.stage = stage
        try:
            yield from tracer.bands(self.film, rays, budget, texture)
        finally:
            texture.release()

    def read(self, items: int) -> Pixels:
        """What the first ``items`` have found, (items, 1)."""
        width, height = self.film.size
        pixels = self.film.read()

        def listed(values: Floats) -> Floats:
            blocks = values[::-1].reshape(height // BLOCK, BLOCK, width // BLOCK, BLOCK, -1).swapaxes(1, 2)
            return blocks.reshape(width * height, 1, -1)[:items]

        return Pixels(listed(pixels.mean), listed(pixels.variance), listed(pixels.half_difference))

    def release(self) -> None:
        self.film.release()


class StageTextures:
    """What stages of a window need besides the film of this one: the finished ones, the picture to be shown, and a list
    of work, of ``most`` items. ``gather`` is the program of film/gather.frag. Raises :class:`DeviceError` if the GPU
    cannot hold them."""

    def __init__(
        self, ctx: moderngl.Context, image_height: int, window: Window, most: int, gather: FullscreenProgram
    ) -> None:
        width, height = window.width, window.height
        self._ctx, self._size, self._gather = ctx, (width, height), gather
        self._texels = np.arange(width * height).reshape(height, width)[::-1].ravel()  # of the pixels of the window
        self.list = ItemList(ctx, image_height, window, most)
        self._owned: list[moderngl.Texture] = []
        try:
            self._finished = self._texture(4, "f4")
            self.textures = tuple(self._texture(4, "f4") for _ in range(3))
            self._items = self._texture(2, "u4")
        except moderngl.Error as error:
            self._release_textures()
            _ = ctx.error  # takes the driver's own note of it away
            raise DeviceError(f"the GPU has no memory for adaptive sampling of {width}x{height}: {error}") from None
        self._picture = Outputs(ctx, self.textures)

    def _texture(self, components: int, dtype: str) -> moderngl.Texture:
        texture = nearest_texture(self._ctx, self._size, components, dtype=dtype)
        self._owned.append(texture)
        return texture

    @property
    def most_items(self) -> int:
        """Items of a list that is drawn at once."""
        width, height = self.list.film.size
        return width * height

    def show(self, texels: list[Floats]) -> Iterator[None]:
        """Begin a stage after those whose picture is ``texels``, in the order of :class:`Pixels`; an upload a step."""
        for texture, image in zip((self._finished, *self.textures), (texels[0], *texels), strict=True):
            texture.write(image)
            yield

    def gather(self, film: Film, work: WorkList, weight: float) -> Iterator[None]:
        """Add the sampled items to the film of this stage, whose weight in the picture is ``weight``, a band of rows
        at a time."""
        width, height = self._size
        items = np.zeros((width * height, 2), np.uint32)
        first = np.flatnonzero(np.diff(work.pixels, prepend=-1))
        texels = self._texels[work.pixels[first]]
        items[texels, 0], items[texels, 1] = first, np.diff(first, append=len(work.pixels))
        self._items.write(items)
        picture, *_ = self.textures
        outputs = Outputs(self._ctx, [*film.back_textures, picture])
        read = (*film.textures, self._items, *self.list.film.textures, self._finished)
        rows = max(1, _GATHERED // width)
        try:
            for bottom in range(0, height, rows):
                for unit, texture in enumerate(read):
                    texture.use(unit)
                outputs.use()
                outputs.restrict(bottom, min(rows, height - bottom))
                self._gather.set({"u_stage_weight": weight})
                self._gather.draw()
                self._ctx.finish()
                yield
        finally:
            outputs.release()
        film.swap(0)

    def read_rows(self, bottom: int, rows: int) -> Pixels:
        """As :meth:`Film.read_rows`, of the picture to be shown."""
        return read_pixels(self._picture, bottom, rows)

    @property
    def gpu_bytes(self) -> int:
        """Size of all textures, without the list of a pass."""
        width, height = self._size
        return self.list.film.gpu_bytes + (4 * 16 + 8) * width * height

    def release(self) -> None:
        self._picture.release()
        self._release_textures()

    def _release_textures(self) -> None:
        for texture in self._owned:
            texture.release()
        self.list.release()


def _listed(ctx: moderngl.Context, texels: NDArray[np.uint32]) -> moderngl.Texture:
    """The texture of a list of work (rows, columns, 2)."""
    rows, columns, _ = texels.shape
    try:
        return nearest_texture(ctx, (columns, rows), 2, np.ascontiguousarray(texels).tobytes(), "u4")
    except moderngl.Error as error:
        _ = ctx.error  # takes the driver's own note of it away
        raise DeviceError(f"the GPU has no memory for a list of {columns * rows} pixels: {error}") from None


def _rows(items: int) -> int:
    """Of a list of so many."""
    return -(-items // (_LIST_WIDTH * BLOCK)) * BLOCK
