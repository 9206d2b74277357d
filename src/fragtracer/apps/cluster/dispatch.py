# SPDX-License-Identifier: MIT
"""Tasks to workers, and what comes back into pictures: nobody is trusted, and nobody is waited for without end."""

import concurrent.futures
import queue
import time
import warnings
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from weakref import WeakKeyDictionary

from distributed import CancelledError, Client, Future
from distributed.client import FutureCancelledError

from fragtracer.apps.cluster import audit
from fragtracer.apps.cluster.picture import Render
from fragtracer.apps.cluster.sampling import Sampling
from fragtracer.apps.cluster.work import NOT_OF_WORKERS, Frame, Part, Task, empty, flaw, pixels_digest, sent_bytes
from fragtracer.apps.cluster.worker import Rendered
from fragtracer.apps.cluster.workers import AHEAD, Workers
from fragtracer.errors import FragtracerError
from fragtracer.films import differences
from fragtracer.renderer import Progress

_MOST_RENDERS = 4  # frames that are rendered at a time, so that workers do not wait for the end of one
_MOST_TRIES = 4  # of a task that does not come back
_MOST_FAILURES = 8  # of a worker, one after the other
_MOMENT = 0.1  # seconds
_SLOW = 20  # times the slowest task so far, after which one is given up


@dataclass
class _Flight:
    """A task in the hands of a ``worker``, for ``sampling``, which ``render`` may have replaced since."""

    future: Future
    render: Render
    sampling: Sampling
    task: Task
    worker: str
    arguments: tuple[str, Frame | None, Part]  # of render_part
    since: float
    suspect: Rendered | None = None  # of which this is the check


class Dispatcher:
    """Renders pictures of the pickled ``scene``, whose digest is ``key``, on the workers of ``client``. ``begin`` is
    called when the first tasks of a picture are due, and returns what keeps checkpoints of it; ``finish`` when it is
    done."""

    def __init__(
        self,
        client: Client,
        scene: bytes,
        key: str,
        patience: float,
        begin: Callable[[Render], Callable[[bool], None] | None],
        finish: Callable[[Render], None],
    ) -> None:
        self.workers = Workers(client, scene, patience)
        self._scene, self._key = scene, key
        self._begin, self._finish = begin, finish
        self._renders: dict[Render, Callable[[bool], None] | None] = {}  # those in progress, and what keeps them
        self._upcoming: Iterator[Render] = iter(())
        self._next_render: Render | None = None
        self._spp = 0.0  # samples per pixel of the pictures that are finished
        self._authors: list[set[str]] = []  # the workers that have had a part in each of them
        self._exposed: list[str] = []  # workers
        self._tries: WeakKeyDictionary[Sampling, Counter[Task]] = WeakKeyDictionary()
        self._failures: Counter[str] = Counter()  # of workers since they have rendered anything
        self._flights: dict[str, _Flight] = {}
        self._arrived: queue.SimpleQueue[tuple[str, concurrent.futures.Future[Rendered]]] = queue.SimpleQueue()
        self._draws = audit.draws()
        self._agreed: dict[Render, dict[str, str]] = {}  # what all workers of a picture say of its origin

    def run(self, renders: Iterator[Render], seconds: float | None, report: Callable[[Progress], None]) -> bool:
        """Render until all is done, or there were samples for some ``seconds``, and are some of each pixel, in which
        case the result is False. ``report`` hears the samples per pixel of all pictures together.

        Raises
        ------
        FragtracerError
            If the work cannot be done: versions differ, no worker is left, the scheduler is gone.
        """
        start = time.perf_counter()
        first: float | None = None  # when there were samples
        self._upcoming = iter(renders)
        self._next_render = next(self._upcoming, None)
        if self._next_render is not None:
            self.workers.greet(self._next_render.origin)
            self._begin_next()
        try:
            while self._renders or self._next_render is not None:
                now = time.perf_counter()
                spp = self._spp + sum(render.spp for render in self._renders)
                first = now if first is None and spp else first
                error = next(iter(self._renders)).sampling.error if self._renders else None
                report(Progress(spp, now - start, error, len(self.workers.alive)))
                is_over = seconds is not None and first is not None and now - first >= seconds
                if is_over and all(render.sampling.is_everywhere for render in self._renders):
                    return False
                if self.workers.glance():
                    self._hurry()
                self._fill()
                self._receive()
                for render, keep in list(self._renders.items()):
                    self._advance(render)
                    if keep is not None and render.can_go_on and not render.is_done:
                        keep(False)
            return True
        finally:
            for flight in self._flights.values():
                flight.future.cancel()

    def _begin_next(self) -> None:
        render = self._next_render
        assert render is not None
        self._next_render = next(self._upcoming, None)
        self._agreed[render] = _without_adaptive(render.origin)
        self._renders[render] = self._begin(render)
        for address in self._exposed:  # which may have had a part in its checkpoint
            render.forget(address)

    def _advance(self, render: Render) -> None:
        def is_certain() -> bool:
            flights = self._flights.values()
            return not any(f.suspect is not None and f.sampling is render.sampling for f in flights)

        while not render.is_done and render.advance(is_certain()):
            pass
        if render.is_done:
            for key in [key for key, flight in self._flights.items() if flight.render is render]:
                self._flights.pop(key).future.cancel()
            self._finish(render)
            del self._renders[render], self._agreed[render]
            self._spp += render.spp
            self._authors.append(render.authors)

    def _next_task(self) -> tuple[Render, Task] | None:
        """What is due, of the earliest picture that has anything."""
        while True:
            for render in self._renders:
                if not render.is_done and (task := render.sampling.next()) is not None:
                    return render, task
            if self._next_render is None or len(self._renders) >= _MOST_RENDERS:
                return None
            self._begin_next()

    def _fill(self) -> None:
        """Keep all workers busy."""
        ready, load = self.workers.ready, Counter(flight.worker for flight in self._flights.values())
        for level in range(AHEAD):
            for address in ready:
                if load[address] > level:
                    continue
                due = self._next_task()
                if due is None:
                    return
                render, task = due
                self._send(address, render, self._cut(address, render, task))
                load[address] += 1

    def _cut(self, address: str, render: Render, task: Task) -> Task:
        """As much of a task as a worker should have at once; the rest is put back."""
        sampling = render.sampling
        left = sum(r.sampling.left for r in self._renders) if self._next_render is None else float("inf")
        most = self.workers.most(address, render.cut.most, left + sampling.cost(task))
        while sampling.cost(task) > 1.5 * most:
            task, *rest = task.halves()
            if not rest:
                break
            sampling.put_back(rest[0])
        return task

    def _send(self, address: str, render: Render, task: Task, suspect: Rendered | None = None) -> None:
        arguments = (self._key, render.frame, render.sampling.part(task))
        priority = -task.step if suspect is None else 1
        future = self.workers.submit(address, *arguments, priority=priority)
        flight = _Flight(future, render, render.sampling, task, address, arguments, time.monotonic(), suspect)
        key = str(future.key)
        self._flights[key] = flight
        self.workers.fetch(future).add_done_callback(lambda result: self._arrived.put((key, result)))

    def _hurry(self) -> None:
        """Give up tasks whose workers have died, and those that have not come for too long, with their workers."""
        patience = max(self.workers.patience, _SLOW * self.workers.slowest)
        patience *= 1 if self.workers.slowest else 10  # nothing has come back yet, perhaps since tasks are large
        now = time.monotonic()
        late = {key for key, flight in self._flights.items() if now - flight.since > patience}
        silent = {flight.worker for key, flight in self._flights.items() if key in late and not flight.future.done()}
        for address in sorted(silent & set(self.workers.alive)):
            self.workers.ban(address, f"a block did not come within {patience:.0f} s")
        alive = set(self.workers.alive)
        for key in [key for key, flight in self._flights.items() if key in late or flight.worker not in alive]:
            flight = self._flights.pop(key)
            flight.future.cancel()
            self._retry(flight, "it does not come from any worker")

    def _receive(self) -> None:
        """Take in what has arrived, or wait a moment. Of many workers much has: who is given what is thought of once
        for all of it."""
        end, patience = time.monotonic() + _MOMENT, _MOMENT
        with suppress(queue.Empty):
            while time.monotonic() < end:
                key, result = self._arrived.get(timeout=patience)
                patience = 0
                if (flight := self._flights.pop(key, None)) is not None:  # otherwise it was given up
                    self._take_in(flight, result)

    def _take_in(self, flight: _Flight, result: concurrent.futures.Future[Rendered]) -> None:
        try:
            rendered = result.result()
        except (CancelledError, FutureCancelledError):  # the worker has lost the scene
            self.workers.lose_scene(flight.worker)
            self._put_back(flight)
        except Exception as error:  # of a worker, its death included
            is_there = flight.worker in self.workers.known()  # raises if it is the scheduler that is gone
            (self._fail if is_there else self._retry)(flight, str(error) or type(error).__name__)
        else:
            self._take(flight, replace(rendered, worker=flight.worker))

    def _retry(self, flight: _Flight, problem: str) -> None:
        self._put_back(flight)
        tries = self._tries.setdefault(flight.sampling, Counter())
        tries[flight.task] += flight.suspect is None
        if tries[flight.task] >= _MOST_TRIES:
            raise FragtracerError(f"a part of the picture cannot be rendered by the cluster: {problem}")

    def _fail(self, flight: _Flight, problem: str) -> None:
        """A worker could not render a task. Others may, and it may do so later."""
        self._put_back(flight)
        self._failures[flight.worker] += 1
        if self._failures[flight.worker] >= _MOST_FAILURES and flight.worker not in self.workers.banned:
            self.workers.ban(flight.worker, f"it cannot render: {problem}")

    def _put_back(self, flight: _Flight) -> None:
        if flight.suspect is None:
            flight.sampling.put_back(flight.task)

    def _take(self, flight: _Flight, rendered: Rendered) -> None:
        render, sampling, task, author = flight.render, flight.sampling, flight.task, flight.worker
        *_, part = flight.arguments
        if author in self.workers.banned:
            self._put_back(flight)
            return
        found = _without_adaptive(rendered.origin)
        if different := _different(_without_adaptive(render.origin), found):  # it came after the others were greeted
            self._put_back(flight)
            self.workers.ban(author, f"it would render another picture: {different}")
            return
        if different := _different(self._agreed[render], found):
            raise FragtracerError(f"the worker {author} would render another picture: {different}")
        self._agreed[render] = found
        wrong = flaw(part, rendered.pixels)
        if not wrong and pixels_digest(rendered.pixels) != rendered.digest:
            wrong = "returned a block that is not what it rendered"
        if wrong:
            self._put_back(flight)
            self._expose(author, wrong)
            return
        del self._failures[author]
        if flight.suspect is not None:
            self._compare(flight, flight.suspect, rendered)
            return
        is_new = author not in self.workers.drivers
        self.workers.note(author, rendered.driver, sampling.cost(task), rendered.seconds)
        render.note(author, rendered.driver)
        render.tasks += 1
        render.wire += sent_bytes(part) + sum(image.nbytes for image in vars(rendered.pixels).values())
        is_checked = next(self._draws) or is_new
        other = self.workers.other(rendered.driver, author) if is_checked and sampling is render.sampling else None
        if other is not None:
            self._send(other, render, task, replace(rendered, pixels=empty(0, 0)))
        sampling.take(task, rendered.pixels, author)

    def _compare(self, flight: _Flight, first: Rendered, second: Rendered) -> None:
        if first.driver != second.driver or first.worker in self.workers.banned:
            return
        flight.render.checked += 1
        if (wrong := audit.liar(self.workers, self._scene, flight.arguments, first, second)) is not None:
            self._expose(wrong, "it rendered a block otherwise than two others")

    def _expose(self, address: str, why: str) -> None:
        """Use a worker no more, and render again what it has had a part in."""
        self.workers.ban(address, why)
        self._exposed.append(address)
        for render in self._renders:
            render.forget(address)
        spoilt = sum(address in authors for authors in self._authors)
        if spoilt:
            warnings.warn(
                f"{spoilt} frames that are written have parts of {address}, of which none of those checked was wrong; "
                "delete the frames of this render to have them rendered again",
                stacklevel=2,
            )


def _different(agreed: dict[str, str], found: dict[str, str]) -> str:
    """What an origin that was ``found`` does not have of the one that is ``agreed`` upon, in words."""
    return differences(agreed, {name: found.get(name, "unknown") for name in agreed})


def _without_adaptive(origin: dict[str, str]) -> dict[str, str]:
    """Workers do not know of it, nor of light tracing and the gradient domain."""
    return {name: value for name, value in origin.items() if name not in NOT_OF_WORKERS}
