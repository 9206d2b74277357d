# SPDX-License-Identifier: MIT
"""Blocks to workers, and what comes back into a picture: nobody is trusted, and nobody is waited for without end."""

import queue
import time
import warnings
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import astuple, dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from distributed import CancelledError, Client, Future

from fragtracer import __version__
from fragtracer.apps.cluster import worker as here
from fragtracer.apps.cluster.work import Block, Cut, Tree, assembled, pixels_digest
from fragtracer.apps.cluster.worker import Rendered, render_block
from fragtracer.errors import DeviceError, FilmError, FragtracerError
from fragtracer.films import SavedFilm, differences
from fragtracer.renderer import Progress
from fragtracer.sampling.pixels import Pixels
from fragtracer.scene import RenderSettings

CHECKED = 1 / 64  # of the blocks, and the first one of each worker, are rendered again elsewhere and compared
_AHEAD = 2  # blocks that each worker has, so that it does not wait for the next
_MOST_WAITING = 512  # blocks that are there before those of the round that is due
_MOST_TRIES = 4  # of a block that comes to nothing
_GONE = "the scheduler of the cluster is gone"
_GLANCE = 1.0  # seconds, between looks at which workers there are


@dataclass(frozen=True)
class Job:
    """A picture: its ``scene``, pickled and on its way to the workers, and its digest ``key``; ``origin`` is what every
    worker has to agree on."""

    scene: bytes
    key: str
    origin: Mapping[str, str]
    settings: RenderSettings
    cut: Cut
    patience: float  # seconds, at least, until a block that does not come is given up


@dataclass
class _Flight:
    block: Block
    since: float
    suspect: Rendered | None = None  # of which this is the check
    workers: frozenset[str] = frozenset()  # that may render it; if none are named, any


@dataclass
class Dispatcher:
    """The state of a render on the workers of ``client``."""

    client: Client
    job: Job
    scene: Future = field(init=False)
    banned: dict[str, str] = field(default_factory=dict)  # workers that are not used any more, and why
    drivers: dict[str, str] = field(default_factory=dict)  # by worker
    checked: int = 0
    wire: int = 0  # bytes of films that came back

    def __post_init__(self) -> None:
        for address, found in self.client.run(here.versions, on_error="return").items():
            self._check(address, found)
        cut = self.job.cut
        self._holders: set[str] = set()  # workers that have had the scene
        self._tiles = cut.tiles
        self._trees = {tile: Tree() for tile in range(len(self._tiles))}
        self._blocks: Iterator[Block] = cut.blocks()
        self._again: deque[Block] = deque()
        self._tries: dict[Block, int] = {}
        self._flights: dict[str, tuple[Future, _Flight]] = {}
        self._arrived: queue.SimpleQueue[Future] = queue.SimpleQueue()
        self._authors: dict[Block, str] = {}  # of the blocks that are there
        self._waiting: dict[Block, Pixels] = {}  # beyond the round at which the error is looked at next
        self._round = 1  # whose blocks are all that the trees hold
        self._stops = False  # whether the error decides when the render ends
        self._present = 0  # blocks that the trees hold
        self._agreed = self.job.origin  # by all workers so far
        self._workers: list[str] = []
        self._glanced = self._seen = time.monotonic() - _GLANCE
        self._slowest = 0.0
        self.pixels = 0  # times samples, that are there

    def run(
        self,
        until: float | None,
        seconds: float | None,
        report: Callable[[Progress], None],
        keep: Callable[[bool], None],
    ) -> bool:
        """Render until all blocks are there, or the error is no more than ``until`` after a round, or time is over, in
        which case the result is False. ``keep`` is called now and then, where :meth:`save` could be.

        Raises
        ------
        FragtracerError
            If the work cannot be done: versions differ, no worker is left, the scheduler is gone.
        """
        start, error, is_good = time.perf_counter(), None, False
        self._stops = until is not None
        try:
            while True:
                elapsed = time.perf_counter() - start
                report(Progress(self.spp, elapsed, error, len(self._workers)))
                if seconds is not None and elapsed >= seconds:
                    return False
                self._glance()
                is_good = is_good and self._is_complete
                if not is_good:
                    self._fill()
                elif all(flight.suspect is None for _, flight in self._flights.values()):
                    return True
                self._receive()
                keep(False)
                while not is_good and self._is_complete:
                    error = self.picture().relative_error()
                    is_good = self._round == self.job.cut.rounds or (until is not None and error <= until)
                    if not is_good:
                        self._next_round()
        finally:
            for future, _ in self._flights.values():
                future.cancel()

    @property
    def settings(self) -> RenderSettings:
        return self.job.settings

    @property
    def spp(self) -> float:
        """Samples per pixel that are there, in the mean."""
        return self.pixels / (self.job.cut.width * self.job.cut.height)

    can_go_on = True  # from what save() writes, always

    def save(self, path: Path) -> None:
        """Write what the trees hold.

        Raises
        ------
        OutputError
            If it cannot be written.
        DeviceError
            If Ctrl-C came while a block was joined.
        """
        blocks = [astuple(block) for block in self._authors if block not in self._waiting]
        held = {(number, tile) for tile, tree in self._trees.items() for number in tree.numbers}
        if held != {(number, tile) for number, tile, _ in blocks}:
            raise DeviceError("the render was interrupted while a block was joined")
        state = {"blocks": blocks, "round": self._round, "block": self.job.cut.samples}
        arrays = {
            f"{tile}.{level}.{place}.{name}": image
            for tile, tree in self._trees.items()
            for (level, place), node in tree.nodes.items()
            for name, image in vars(node).items()
        }
        SavedFilm(self.job.origin, driver_list(self.drivers), (), {}, state, arrays).write(path)

    def resume(self, path: Path) -> None:
        """Go on from what :meth:`save` has written; raises :class:`FilmError` where it is of another render."""
        film, cut = SavedFilm.read(path), self.job.cut
        if "blocks" not in film.state:
            raise FilmError(f"{path}: this film was not rendered on a cluster; go on without --cluster")
        film.check(self.job.origin, path)
        if film.state["block"] != cut.samples:
            raise FilmError(f"{path}: --block is {film.state['block']} there, {cut.samples} here")
        blocks = [Block(*block) for block in film.state["blocks"]]
        if any(block != cut.block(block.number, block.tile) for block in blocks):
            raise FilmError(f"{path}: this film has samples beyond --spp {cut.spp}, or a last block that is shorter")
        for name, image in film.arrays.items():
            tile, level, place, part = name.split(".")
            node = self._trees[int(tile)].nodes.setdefault((int(level), int(place)), _NOTHING)
            self._trees[int(tile)].nodes[int(level), int(place)] = replace(node, **{part: image})
        self._authors = dict.fromkeys(blocks, "")
        self._present, self._round = len(blocks), film.state["round"]
        self.pixels = sum(b.spp * self._tiles[b.tile].width * self._tiles[b.tile].height for b in blocks)

    def picture(self) -> Pixels:
        """Of all blocks of the finished rounds, and what there is of the next."""
        return assembled(self.job.cut, self._trees)

    def all_there_is(self) -> Pixels:
        """Of all blocks that have come back."""
        for block, pixels in self._waiting.items():
            self._trees[block.tile].add(block.number, pixels)
        self._waiting.clear()
        return self.picture()

    def _check(self, address: str, found: Any) -> None:
        """Refuse a worker that cannot render, or renders otherwise, before there is work."""
        if isinstance(found, Exception):
            raise FragtracerError(
                f"the worker {address} cannot render: {found}; install fragtracer {__version__} there"
            )
        if different := differences({name: self.job.origin[name] for name in found}, found):
            raise FragtracerError(f"the worker {address} has another fragtracer: {different}")

    def _glance(self) -> None:
        """Which workers there are."""
        now = time.monotonic()
        if now - self._glanced < _GLANCE:
            return
        self._glanced = now
        if self.client.status != "running":
            raise FragtracerError(_GONE)
        try:
            known = self.client.scheduler_info(n_workers=-1)["workers"]
        except (OSError, TimeoutError) as error:
            raise FragtracerError(f"{_GONE}: {error}") from None
        self._workers = sorted(address for address in known if address not in self.banned)
        if known and not self._workers:
            why = "; ".join(f"{name}: {reason}" for name, reason in self.banned.items())
            raise FragtracerError(f"no worker of the cluster is left to render: {why}")
        self._seen = now if self._workers else self._seen
        if set(self._workers) - self._holders:
            with suppress(TimeoutError):  # of workers that have just died
                (self.scene,) = self.client.scatter([self.job.scene], broadcast=True, hash=True, timeout=_GLANCE)
                self._holders |= set(self._workers)
        if now - self._seen > self.job.patience:
            raise FragtracerError(f"the cluster has had no workers for {self.job.patience:.0f} s")
        self._hurry()

    def _hurry(self) -> None:
        """Give up blocks that no worker is left for, and those that have not come for too long with their workers."""
        patience = max(self.job.patience, 10 * _AHEAD * self._slowest)
        patience *= 1 if self._slowest else 10  # nothing has come back yet, perhaps since blocks are large
        now, alive = time.monotonic(), set(self._workers)
        flights = {key: flight for key, (_, flight) in self._flights.items()}
        late = {key for key, flight in flights.items() if now - flight.since > patience}
        stranded = {key for key, flight in flights.items() if flight.workers and not flight.workers & alive}
        if late and alive:
            running = {str(key): address for address, keys in self.client.processing().items() for key in keys}
            for address in sorted({running[key] for key in late if key in running} - self.banned.keys()):
                self._ban(address, f"a block did not come within {patience:.0f} s")
        for key in late | stranded:
            self._flights.pop(key)[0].cancel()
            if flights[key].suspect is None:
                self._retry(flights[key].block, "it does not come from any worker")

    def _fill(self) -> None:
        """Keep all workers busy."""
        while len(self._flights) < _AHEAD * len(self._workers) and self._holders:
            if not self._again and len(self._waiting) > _MOST_WAITING:
                return
            block = self._again.popleft() if self._again else next(self._blocks, None)
            if block is None:
                return
            if block not in self._authors:
                self._send(block)

    def _send(self, block: Block, suspect: Rendered | None = None, workers: list[str] | None = None) -> None:
        window = replace(self._tiles[block.tile], first_sample=block.number * self.job.cut.samples)
        chosen = workers or (self._workers if self.banned else None)
        future = self.client.submit(
            *(render_block, self.scene, self.job.key, window, block.spp),
            key=f"block-{block.tile}-{block.number}-{time.monotonic_ns()}",
            priority=-block.number if suspect is None else 1,
            workers=chosen,
            pure=False,
        )
        self._flights[future.key] = future, _Flight(block, time.monotonic(), suspect, frozenset(chosen or ()))
        future.add_done_callback(self._arrived.put)

    def _receive(self) -> None:
        """Take in what has arrived, or wait a moment."""
        try:
            future = self._arrived.get(timeout=0.1)
        except queue.Empty:
            return
        _, flight = self._flights.pop(str(future.key), (None, None))
        if flight is None:
            return  # it was given up
        try:
            rendered = future.result(timeout=self.job.patience)
        except FragtracerError as error:
            if flight.suspect is None:
                self._retry(flight.block, str(error))
            return
        except CancelledError:  # the only workers that had the scene have died
            self._holders.clear()
            self._workers.clear()
            if flight.suspect is None:
                self._again.append(flight.block)
            return
        except Exception as error:  # of a worker, its death included
            if self.client.status != "running":
                raise FragtracerError(_GONE) from None
            if flight.suspect is None:
                self._retry(flight.block, str(error) or type(error).__name__)
            return
        self._take(flight, rendered)

    def _retry(self, block: Block, problem: str) -> None:
        self._tries[block] = self._tries.get(block, 0) + 1
        if self._tries[block] >= _MOST_TRIES:
            raise FragtracerError(f"a part of the picture cannot be rendered by the cluster: {problem}")
        self._again.append(block)

    def _take(self, flight: _Flight, rendered: Rendered) -> None:
        block, author = flight.block, rendered.worker
        if found := differences(self._agreed, {name: rendered.origin.get(name, "unknown") for name in self._agreed}):
            raise FragtracerError(f"the worker {author} would render another picture: {found}")
        self._agreed = rendered.origin
        if author in self.banned:
            if flight.suspect is None:
                self._retry(block, "is always rendered by workers that failed")
            return
        if flaw := _flaw(rendered, self._tiles[block.tile].height, self._tiles[block.tile].width, block.spp):
            self._expose(author, flaw)
            if flight.suspect is None:
                self._again.append(block)
            return
        if flight.suspect is not None:
            self._compare(block, flight.suspect, rendered)
            return
        is_new = author not in self.drivers
        self.drivers[author] = rendered.driver
        self._slowest = max(self._slowest, rendered.seconds)
        if block in self._authors:
            return
        self._authors[block] = author
        self.pixels += block.spp * rendered.pixels.mean[..., 0].size
        self.wire += sum(image.nbytes for image in vars(rendered.pixels).values())
        self._waiting[block] = rendered.pixels
        self._plant()
        if is_new or _is_drawn(block):
            others = self._others(rendered.driver, author)
            if others:
                self._send(block, replace(rendered, pixels=_NOTHING), others)

    def _others(self, driver: str, *but: str) -> list[str]:
        """Workers of the same driver, besides some; those of which nothing is known yet among them."""
        return [a for a in self._workers if a not in but and self.drivers.get(a, driver) == driver]

    def _compare(self, block: Block, first: Rendered, second: Rendered) -> None:
        """Where two workers of one driver disagree, a third one decides, or this machine."""
        if first.driver != second.driver or first.worker in self.banned:
            return
        self.checked += 1
        if first.digest == second.digest:
            return
        third = self._third(block, first, second)
        if third.digest not in (first.digest, second.digest):
            raise FragtracerError(
                f"{first.worker}, {second.worker} and {third.worker} each render another picture of one block; see "
                "what fragtracer doctor says of them"
            )
        wrong = second.worker if third.digest == first.digest else first.worker
        self._expose(wrong, "it rendered a block otherwise than two others")

    def _third(self, block: Block, first: Rendered, second: Rendered) -> Rendered:
        window = replace(self._tiles[block.tile], first_sample=block.number * self.job.cut.samples)
        arguments = (self.job.key, window, block.spp)
        if others := self._others(first.driver, first.worker, second.worker):
            future = self.client.submit(render_block, self.scene, *arguments, workers=others, pure=False, priority=2)
            try:
                found: Rendered = future.result(timeout=self.job.patience)
                if found.driver == first.driver:
                    return found
            except Exception as error:  # of that worker
                reason = str(error)
        try:
            own = here.render_block(self.job.scene, *arguments, worker="this machine")
            if own.driver == first.driver:
                return own
            reason = f"this machine has another driver, {own.driver}"
        except DeviceError as error:
            reason = str(error)
        finally:
            here.close()
        raise FragtracerError(
            f"{first.worker} and {second.worker} render different pictures of one block, and there is no third "
            f"opinion: {reason}; see what fragtracer doctor says of them"
        )

    def _expose(self, address: str, why: str) -> None:
        """Use a worker no more, and render again all tiles that it has had a part in."""
        self._ban(address, why)
        tiles = {block.tile for block, author in self._authors.items() if author == address}
        for block in [block for block in self._authors if block.tile in tiles]:
            del self._authors[block]
            self._present -= block not in self._waiting
            window = self._tiles[block.tile]
            self.pixels -= block.spp * window.width * window.height
            self._waiting.pop(block, None)
            self._again.append(block)
        for tile in tiles:
            self._trees[tile] = Tree()

    def _ban(self, address: str, why: str) -> None:
        warnings.warn(f"the worker {address} is not used any more: {why}", stacklevel=2)
        self.banned[address] = why
        self._workers = [worker for worker in self._workers if worker != address]

    @property
    def _is_complete(self) -> bool:
        """Whether the trees hold all blocks of the rounds until the next look at the error."""
        return self._present == self._round * len(self._tiles)

    def _next_round(self) -> None:
        """Look at the error again when there are a quarter more samples, or, where nothing depends on it, twice as
        many."""
        self._round += max(1, self._round // 4) if self._stops else self._round
        self._round = min(self._round, self.job.cut.rounds or self._round)
        self._plant()

    def _plant(self) -> None:
        """Give the trees the blocks of the rounds that are due."""
        for block in [block for block in self._waiting if block.number < self._round]:
            self._trees[block.tile].add(block.number, self._waiting.pop(block))
            self._present += 1


_NOTHING = Pixels(*(np.zeros((0, 0, n), np.float32) for n in (4, 4, 3)))


def _is_drawn(block: Block) -> bool:
    """Whether a block is among those that are checked."""
    return hash((block.tile, block.number)) % round(1 / CHECKED) == 0


def _flaw(rendered: Rendered, height: int, width: int, spp: int) -> str:
    """What is wrong with a block at first sight; empty if nothing is."""
    pixels = rendered.pixels
    if [image.shape for image in vars(pixels).values()] != [(height, width, n) for n in (4, 4, 3)]:
        return "returned a block of another size"
    if pixels_digest(pixels) != rendered.digest:
        return "returned a block that is not what it rendered"
    if not (pixels.mean[..., 3] + pixels.variance[..., 3] == spp).all():
        return "returned a block without all of its samples"
    return ""


def driver_list(drivers: Mapping[str, Any]) -> str:
    """The different ones, for metadata."""
    return ", ".join(sorted(set(drivers.values())))
