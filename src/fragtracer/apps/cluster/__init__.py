# SPDX-License-Identifier: MIT
"""A picture rendered by many machines, on Dask (docs/cluster.md)."""

import logging
import os
import pickle
import re
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any

from fragtracer import __version__
from fragtracer.apps.cluster.work import BLOCK, Cut
from fragtracer.errors import FragtracerError
from fragtracer.films import origin_of
from fragtracer.renderer import Progress
from fragtracer.sampling.pixels import Pixels
from fragtracer.scene import Scene
from fragtracer.scene.content import content_digest

_REACH = 10.0  # seconds, to reach a scheduler and to see a worker
_PATIENCE = 60.0  # seconds until a block that does not come is given up, at least
_LOCAL = re.compile(r"local:(\d{1,4})")
_NEAR = re.compile(r"(tls://|inproc://|(tcp|ws)://(localhost|127\.|\[::1\]))")


@dataclass(frozen=True)
class Picture:
    """What a cluster has rendered: ``pixels``, ``metadata`` for the file, and whether the user has ``interrupted`` or
    something else has, the ``problem``. ``wire`` is how many bytes of films came back."""

    pixels: Pixels
    metadata: dict[str, str]
    interrupted: bool
    problem: str | None
    wire: int


def check(scene: Scene, block: int = BLOCK) -> None:
    """Raise FragtracerError where a cluster cannot render ``scene`` in blocks of ``block`` samples."""
    settings = scene.render
    if settings.adaptive == "on" or settings.integrator != "path":
        raise FragtracerError("a cluster renders evenly, and paths: it needs --no-adaptive and --integrator path")
    if block % 2:
        raise FragtracerError(f"--block {block}: give an even number; samples belong to two streams in turns")


def render(
    scene: Scene,
    client: Any,
    spp: int | None = None,
    seconds: float | None = None,
    until: float | None = None,
    progress: Callable[[Progress], None] | None = None,
    block: int = BLOCK,
    patience: float = _PATIENCE,
    begin: Callable[[Any], Any] | None = None,
) -> Picture:
    """Render ``scene`` on the workers of a Dask client (:func:`connected`); the limits are those of
    :meth:`fragtracer.renderer.Renderer.render`. ``block`` is how many samples of each pixel of a tile are one task.

    ``begin``, given what has ``save`` and ``resume`` as a renderer, returns what keeps checkpoints.

    The bits depend on the scene, the number of samples and ``block``; not on the workers, their number or their fate.

    Raises
    ------
    FragtracerError
        If sampling is adaptive, or nothing came back.
    """
    from fragtracer.apps.cluster.dispatch import Dispatcher, Job, driver_list

    check(scene, block)
    settings = scene.render
    if spp is None and seconds is None and until is None:
        spp = settings.spp
    scene = replace(scene, render=replace(settings, adaptive="off"))
    origin = origin_of(scene, scene.render)
    content = pickle.dumps(scene, protocol=5)
    cut = Cut(settings.width, settings.height, block, spp)
    job = Job(content, content_digest(repr(sorted(origin.items()))), origin, scene.render, cut, patience)
    dispatcher = Dispatcher(client, job)
    keeper = begin(dispatcher) if begin is not None else None
    interrupted, problem = False, None
    try:
        try:
            is_complete = dispatcher.run(until, seconds, progress or (lambda _: None), keeper or (lambda _: None))
        finally:
            if keeper is not None:
                keeper.finish()
        pixels = dispatcher.picture() if is_complete else dispatcher.all_there_is()
    except (KeyboardInterrupt, FragtracerError) as error:
        if not dispatcher.pixels:
            raise
        interrupted, problem = isinstance(error, KeyboardInterrupt), str(error) or None
        pixels = dispatcher.all_there_is()
    samples = pixels.mean[..., 3] + pixels.variance[..., 3]
    metadata = {name: str(value) for name, value in vars(scene.render).items() if not name.startswith("_")}
    metadata |= {"software": f"fragtracer {__version__}", "scene": scene.name}
    metadata |= {
        "spp": f"{samples.mean(dtype=float):.0f}",
        "block": str(block),
        "workers": str(len(dispatcher.drivers)),
    }
    metadata |= {"non_finite_samples": str(int(pixels.variance[..., 3].sum(dtype=float)))}
    metadata |= {"checked_blocks": str(dispatcher.checked), "gl_renderer": driver_list(dispatcher.drivers)}
    if dispatcher.banned:
        metadata["banned_workers"] = "; ".join(f"{name}: {why}" for name, why in dispatcher.banned.items())
    return Picture(pixels, metadata, interrupted, problem, dispatcher.wire)


@contextmanager
def connected(address: str) -> Iterator[Any]:
    """A Dask client of the cluster at ``address``, as "tcp://host:8786" or "tls://…", or of "local:N", N processes that
    are started here.

    Raises
    ------
    FragtracerError
        If Dask is not installed, the cluster cannot be reached, or has no workers.
    """
    try:
        from distributed import Client, LocalCluster
    except ImportError:
        raise FragtracerError(
            "rendering on a cluster needs Dask: type  pip install 'fragtracer[cluster]'  on each machine"
        ) from None
    for name in [name for name in logging.root.manager.loggerDict if name.startswith("distributed")]:
        logging.getLogger(name).setLevel(logging.CRITICAL)  # what goes wrong is told in one message
    if local := _LOCAL.fullmatch(address):
        workers = int(local[1])
        if not workers:
            raise FragtracerError(f"--cluster {address}: give at least one process, as local:2")
        threads = {"LP_NUM_THREADS": str(max(1, (os.cpu_count() or 1) // workers))}  # of Mesa, which takes all else
        with (
            LocalCluster(
                n_workers=workers,
                threads_per_worker=1,
                processes=True,
                dashboard_address=":0",
                silence_logs=logging.CRITICAL,
                env=threads if "LP_NUM_THREADS" not in os.environ else {},
            ) as cluster,
            Client(cluster) as client,
        ):
            yield client
        return
    if not re.match(r"[a-z]+://", address):
        raise FragtracerError(
            f"--cluster {address}: give the address of a Dask scheduler, as tcp://host:8786, or local:2"
        )
    if not _NEAR.match(address):
        warnings.warn(f"{address} is not encrypted, and runs what anybody on the way sends; use tls://", stacklevel=3)
    try:
        client = Client(address, timeout=_REACH)
    except (OSError, ValueError, TimeoutError) as error:
        raise FragtracerError(f"--cluster {address}: cannot be reached within {_REACH:.0f} s: {error}") from None
    with client:
        try:
            client.wait_for_workers(1, timeout=_REACH)
        except TimeoutError:
            raise FragtracerError(
                f"{address} has no workers; start some, as: dask worker {address} --nthreads 1"
            ) from None
        yield client
