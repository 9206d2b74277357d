# SPDX-License-Identifier: MIT
"""A picture rendered by many machines, on Dask (docs/cluster.md)."""

import logging
import os
import pickle
import re
import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from fragtracer.apps.cluster.work import BLOCK, NOT_OF_WORKERS, Frame
from fragtracer.errors import FragtracerError
from fragtracer.films import origin_of
from fragtracer.interruption import children_uninterrupted, deferred
from fragtracer.renderer import Progress
from fragtracer.sampling.allocation import FIRST_STAGE
from fragtracer.sampling.pixels import Pixels
from fragtracer.scene import Scene
from fragtracer.scene.content import content_digest

if TYPE_CHECKING:
    from fragtracer.apps.cluster.dispatch import Dispatcher
    from fragtracer.apps.cluster.picture import Render

_REACH = 10.0  # seconds, to reach a scheduler and to see a worker
_PATIENCE = 60.0  # seconds until a block that does not come is given up, at least
# What Dask watches of itself all the time takes 3 % of a core from each process.
_SPARING = {"distributed.worker.profile.enabled": False, "distributed.admin.tick.interval": "1s"}
_LOCAL = re.compile(r"local:(\d{1,4})")
_NEAR = re.compile(r"(tls://|inproc://|(tcp|ws)://(localhost|127\.|\[::1\]))")


@dataclass(frozen=True)
class Picture:
    """What a cluster has rendered: ``pixels``, ``metadata`` for the file, and whether the user has ``interrupted`` or
    something else has, the ``problem``. ``tasks`` have come back, and ``wire`` bytes of films and of numbers of samples
    went there and back, without those of what is rendered twice."""

    pixels: Pixels
    metadata: dict[str, str]
    interrupted: bool
    problem: str | None
    tasks: int
    wire: int


def check(scene: Scene, block: int = BLOCK) -> None:
    """Raise FragtracerError where a cluster cannot render ``scene`` in blocks of ``block`` samples."""
    if scene.render.integrator != "path":
        raise FragtracerError("a cluster renders paths: it needs --integrator path")
    if scene.render.light_tracing == "on":
        raise FragtracerError("a cluster renders paths alone: it needs --light-tracing auto or off")
    if scene.render.gradient_domain == "on":
        raise FragtracerError("a cluster renders pixels alone: it needs --gradient-domain auto or off")
    if block % 2 or block < FIRST_STAGE:
        raise FragtracerError(
            f"--block {block}: give an even number, {FIRST_STAGE} or more; samples belong to two streams in turns"
        )


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
    :meth:`fragtracer.renderer.Renderer.render`. ``block`` is how many samples of each pixel of a tile are one task at
    most.

    ``begin``, given what has ``save`` and ``resume`` as a renderer, returns what keeps checkpoints.

    The bits depend on the scene, the number of samples and, where sampling is even, ``block``; not on the workers,
    their number or their fate.

    Raises
    ------
    FragtracerError
        If the scene cannot be rendered so, or nothing came back.
    """
    from fragtracer.apps.cluster.dispatch import Dispatcher
    from fragtracer.apps.cluster.picture import Render

    check(scene, block)
    whole = Render(scene, block, _limit(scene, spp, seconds, until), until)
    keepers: list[Any] = []

    def begun(one: "Render") -> Any:
        keepers.append(begin(one) if begin is not None else None)
        return keepers[0]

    content, key = _packed(scene)
    dispatcher = Dispatcher(client, content, key, patience, begun, lambda _: None)
    interrupted, problem = False, None
    try:
        try:
            is_complete = dispatcher.run(iter([whole]), seconds, progress or (lambda _: None))
        finally:
            if keepers and keepers[0] is not None:
                keepers[0].finish()
        pixels = whole.sampling.picture() if is_complete else whole.sampling.all_there_is()
    except (KeyboardInterrupt, FragtracerError) as error:
        if not whole.sampling.samples:
            raise
        interrupted, problem = isinstance(error, KeyboardInterrupt), str(error) or None
        pixels = whole.sampling.all_there_is()
    return _picture(whole, dispatcher, pixels, interrupted, problem)


def render_frames(
    scene: Scene,
    frames: Mapping[int, Scene],
    client: Any,
    write: Callable[[int, Picture], None],
    spp: int | None = None,
    until: float | None = None,
    progress: Callable[[Progress], None] | None = None,
    block: int = BLOCK,
    patience: float = _PATIENCE,
    begin: Callable[[Any, int], Any] | None = None,
    count: int | None = None,
) -> None:
    """Render ``frames`` of ``scene``, which differ from it in the camera and the seed, by number; the end of one and
    the beginning of the next at a time. Workers learn once, for ``count`` frames, or for these. ``write`` is called
    with each when it is done, ``begin`` as in :func:`render`, with the number; what it returns is asked to ``remove``
    the checkpoint when the frame is written.

    Raises
    ------
    FragtracerError
        If the scene cannot be rendered so, or the work cannot be done.
    KeyboardInterrupt
        On Ctrl-C; checkpoints are written before.
    """
    from fragtracer.apps.cluster.dispatch import Dispatcher
    from fragtracer.apps.cluster.picture import Render

    check(scene, block)
    spp, count = _limit(scene, spp, None, until), count or len(frames)
    numbers: dict[Render, int] = {}
    keepers: dict[Render, Any] = {}

    def renders() -> Iterator[Render]:
        for number, moved in frames.items():
            one = Render(moved, block, spp, until, Frame(moved.camera, moved.render.seed, count))
            numbers[one] = number
            yield one

    def begun(one: Render) -> Any:
        if begin is not None:
            keepers[one] = begin(one, numbers[one])
        return keepers.get(one)

    def finish(one: Render) -> None:
        write(numbers.pop(one), _picture(one, dispatcher, one.sampling.picture(), False, None))
        if one in keepers:
            keepers.pop(one).remove()

    content, key = _packed(scene, "moves", str(count))
    dispatcher = Dispatcher(client, content, key, patience, begun, finish)
    try:
        dispatcher.run(renders(), None, progress or (lambda _: None))
    finally:
        for keeper in keepers.values():
            keeper.finish()


def origin_of_frame(scene: Scene, block: int) -> dict[str, str]:
    """What decides over the picture of a frame, but for its limits and the driver."""
    return origin_of(scene, scene.render, cluster=block)


def _limit(scene: Scene, spp: int | None, seconds: float | None, until: float | None) -> int | None:
    return scene.render.spp if spp is None and seconds is None and until is None else spp


def _packed(scene: Scene, *more: str) -> tuple[bytes, str]:
    """For the workers, who do not plan, with its digest."""
    choices: dict[str, Any] = dict.fromkeys(NOT_OF_WORKERS, "off")
    scene = replace(scene, render=replace(scene.render, **choices))
    origin = origin_of(scene, scene.render) | {"spp": str(scene.render.spp)}
    return pickle.dumps(scene, protocol=5), content_digest(repr(sorted(origin.items())), *more)


def _picture(
    one: "Render", dispatcher: "Dispatcher", pixels: Pixels, interrupted: bool, problem: str | None
) -> Picture:
    samples = pixels.mean[..., 3] + pixels.variance[..., 3]
    metadata = one.metadata() | {"spp": f"{samples.mean(dtype=float):.0f}"}
    metadata |= {"non_finite_samples": str(int(pixels.variance[..., 3].sum(dtype=float)))}
    if banned := dispatcher.workers.banned:
        metadata["banned_workers"] = "; ".join(f"{name}: {why}" for name, why in banned.items())
    return Picture(pixels, metadata, interrupted, problem, one.tasks, one.wire)


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
        with deferred():
            from dask import config
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
        with config.set(_SPARING), ExitStack() as started:
            # Dask cannot close a cluster that has started in part; and its processes say much if they are interrupted.
            with deferred(), children_uninterrupted():
                cluster = LocalCluster(
                    n_workers=workers,
                    threads_per_worker=1,
                    processes=True,
                    dashboard_address=":0",
                    silence_logs=logging.CRITICAL,
                    env=threads if "LP_NUM_THREADS" not in os.environ else {},
                )
                started.enter_context(cluster)
                client = started.enter_context(Client(cluster, direct_to_workers=True))  # not through the scheduler
            yield client
        return
    if not re.match(r"[a-z]+://", address):
        raise FragtracerError(
            f"--cluster {address}: give the address of a Dask scheduler, as tcp://host:8786, or local:2"
        )
    if not _NEAR.match(address):
        warnings.warn(f"{address} is not encrypted, and runs what anybody on the way sends; use tls://", stacklevel=3)
    try:
        try:
            client = Client(address, timeout=_REACH)
        except AssertionError:  # Dask's, where the scheduler has news for its clients just then
            client = Client(address, timeout=_REACH)
    except TypeError:  # as Dask has it
        tls = "DASK_DISTRIBUTED__COMM__TLS__"
        wanted = f"set {tls}CA_FILE, {tls}CLIENT__CERT and {tls}CLIENT__KEY"
        raise FragtracerError(f"--cluster {address}: cannot be reached without a certificate; {wanted}") from None
    except (OSError, ValueError, RuntimeError) as error:
        raise FragtracerError(f"--cluster {address}: cannot be reached within {_REACH:.0f} s: {error}") from None
    with client:
        try:
            client.wait_for_workers(1, timeout=_REACH)
        except TimeoutError:
            raise FragtracerError(
                f"{address} has no workers; start some, as: dask worker {address} --nthreads 1"
            ) from None
        yield client
