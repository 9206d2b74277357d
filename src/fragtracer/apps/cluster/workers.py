# SPDX-License-Identifier: MIT
"""The workers of a cluster: which there are, which are trusted, how fast they are, and that they have the scene."""

import asyncio
import concurrent.futures
import random
import time
import warnings
from collections.abc import Collection, Mapping
from contextlib import suppress
from typing import Any

from distributed import Client, Future, wait

from fragtracer import __version__
from fragtracer.apps.cluster import worker as here
from fragtracer.errors import FragtracerError
from fragtracer.films import differences

AHEAD = 2  # tasks that each worker has, so that it does not wait for the next
_GLANCE = 1.0  # seconds, between looks at which workers there are
LONGEST, _SHORTEST = 10.0, 0.25  # seconds of a task, where a tile can be cut so
_NEWEST = 0.3  # weight of the last task in the speed of a worker
_SENDING = 10  # times the patience, after which a worker that has not taken the scene is left


class Workers:
    """Those of ``client`` that may render the pickled ``scene``; ``patience`` is for how many seconds, at least, one
    waits for a task."""

    def __init__(self, client: Client, scene: bytes, patience: float) -> None:
        self._client, self._content, self.patience = client, scene, patience
        self.alive: list[str] = []  # and not banned
        self.banned: dict[str, str] = {}  # those that are not used any more, and why
        self.drivers: dict[str, str] = {}  # of those that have rendered
        self.slowest = 0.0  # seconds of a task
        self._speeds: dict[str, float] = {}  # samples a second
        self._fastest: float | None = None  # of them, until one changes
        # The scene on each worker, a future of its own: of one that several hold, Dask's memory manager keeps one copy.
        self._scenes: dict[str, Future] = {}
        self._sending: dict[str, tuple[concurrent.futures.Future[Future], float]] = {}  # those on the way, since when
        self._glanced = self._seen = time.monotonic() - _GLANCE

    def greet(self, origin: Mapping[str, str]) -> None:
        """Refuse a worker that cannot render, or renders otherwise than ``origin`` says, before there is work; leave
        one that does not answer.

        Raises
        ------
        FragtracerError
            Naming the worker and what is wrong.
        """
        greeted = {a: self._client.submit(here.versions, workers=[a], pure=False, priority=1) for a in self.known()}
        with suppress(TimeoutError):
            wait(list(greeted.values()), timeout=self.patience)
        for address, future in greeted.items():
            if not future.done():
                self.ban(address, f"it does not answer within {self.patience:.0f} s")
            elif future.status == "error":
                raise FragtracerError(
                    f"the worker {address} cannot render: {future.exception()}; install fragtracer {__version__} there"
                )
            elif future.status == "finished":
                found = future.result()
                if different := differences({name: origin[name] for name in found}, found):
                    raise FragtracerError(f"the worker {address} has another fragtracer: {different}")

    def glance(self) -> bool:
        """Now and then, look which workers there are, and send the scene to those that do not have it; whether this was
        done now.

        Raises
        ------
        FragtracerError
            If the scheduler is gone, or no worker is left.
        """
        now = time.monotonic()
        if now - self._glanced < _GLANCE:
            return False
        self._glanced = now
        known = self.known()
        self.alive = sorted(address for address in known if address not in self.banned)
        if known and not self.alive:
            why = "; ".join(f"{name}: {reason}" for name, reason in self.banned.items())
            raise FragtracerError(f"no worker of the cluster is left to render: {why}")
        self._seen = now if self.alive else self._seen
        for address in set(self.alive) - set(self._scenes) - set(self._sending):
            self._sending[address] = self._send_scene(address), now
        for address, (_, since) in list(self._sending.items()):
            if address not in known:
                del self._sending[address]
            elif now - since > _SENDING * self.patience:
                del self._sending[address]
                self.ban(address, f"it has not taken the scene within {_SENDING * self.patience:.0f} s")
        if now - self._seen > self.patience:
            raise FragtracerError(f"the cluster has had no workers for {self.patience:.0f} s")
        return True

    def known(self) -> Collection[str]:
        """The addresses that the scheduler knows; raises FragtracerError if it is gone, or does not answer."""
        if self._client.status == "running":
            try:
                found: dict[str, int] = self._client.sync(self._client.scheduler.ncores, callback_timeout=self.patience)
                return found.keys()
            except TimeoutError:
                if self._client.status == "running":
                    silence = f"the scheduler of the cluster has not answered for {self.patience:.0f} s"
                    raise FragtracerError(silence) from None
            except OSError:
                pass
        raise FragtracerError("the scheduler of the cluster is gone")

    @property
    def ready(self) -> list[str]:
        """Those that have the scene, the fastest first."""
        for address in [address for address, (sent, _) in self._sending.items() if sent.done()]:
            sent, _ = self._sending.pop(address)
            if sent.exception() is None:  # otherwise it is sent again, if the worker is still there
                self._scenes[address] = sent.result()
        ready = [address for address in self.alive if address in self._scenes]
        return sorted(ready, key=lambda address: -self._speeds.get(address, 0))

    def lose_scene(self, address: str) -> None:
        """A worker does not have it any more."""
        self._scenes.pop(address, None)

    def note(self, address: str, driver: str, samples: int, seconds: float) -> None:
        """How long a task took."""
        self.drivers[address] = driver
        self.slowest = max(self.slowest, seconds)
        if samples:
            speed = samples / max(seconds, 1e-6)
            known = self._speeds.get(address, speed)
            self._speeds[address] = known + _NEWEST * (speed - known)
            self._fastest = None

    def most(self, address: str, block: int, left: float) -> float:
        """Samples of the next task of a worker: a whole ``block`` for the fastest, less for slower ones, so that each
        takes as long; less also when few are ``left``, so that all end together."""
        if address not in self._speeds:
            return block
        speed = self._speeds[address]
        self._fastest = self._fastest or max(self._speeds.values())
        most = min(block * speed / self._fastest, speed * LONGEST)
        return max(min(most, left / (AHEAD * max(1, len(self.alive)))), speed * _SHORTEST)

    def other(self, driver: str, *but: str) -> str | None:
        """One by chance that has the same driver, as far as is known, and is none of some; None if there is none."""
        start = random.randrange(max(1, len(self.alive)))
        for address in self.alive[start:] + self.alive[:start]:
            is_ready = address in self._scenes and address not in but
            if is_ready and self.drivers.get(address, driver) == driver:
                return address
        return None

    def ban(self, address: str, why: str) -> None:
        """Use a worker no more."""
        warnings.warn(f"the worker {address} is not used any more: {why}", stacklevel=2)
        self.banned[address] = why
        self.alive = [worker for worker in self.alive if worker != address]
        self._speeds.pop(address, None)
        self._fastest = None

    def submit(self, address: str, *arguments: Any, priority: int = 0) -> Future:
        """Have a part rendered by one that is :attr:`ready`; ``arguments`` are those of
        :func:`fragtracer.apps.cluster.worker.render_part` after the scene."""
        scene = self._scenes[address]
        return self._client.submit(
            here.render_part, scene, *arguments, workers=[address], pure=False, priority=priority
        )

    def _send_scene(self, address: str) -> concurrent.futures.Future[Future]:
        async def scattered() -> Future:
            (scene,) = await self._client.scatter([self._content], workers=[address], hash=False, asynchronous=True)
            return scene

        return asyncio.run_coroutine_threadsafe(scattered(), self._client.loop.asyncio_loop)

    def fetch(self, future: Future) -> concurrent.futures.Future[Any]:
        """Its result, when it is here; nobody waits for it, since a worker may die or fall silent on the way."""

        async def gathered() -> Any:
            return await self._client.gather(future, asynchronous=True)

        return asyncio.run_coroutine_threadsafe(gathered(), self._client.loop.asyncio_loop)
