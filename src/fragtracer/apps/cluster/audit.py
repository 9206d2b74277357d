# SPDX-License-Identifier: MIT
"""Whether workers render what they should: some of what comes back is rendered again elsewhere and compared."""

import random
from collections.abc import Iterator
from dataclasses import replace

from fragtracer.apps.cluster import worker as here
from fragtracer.apps.cluster.work import Frame, Part
from fragtracer.apps.cluster.worker import Rendered
from fragtracer.apps.cluster.workers import Workers
from fragtracer.errors import DeviceError, FragtracerError

CHECKED = 64  # one of so many tasks, and the first one of each worker, are rendered again


def draws() -> Iterator[bool]:
    """Whether the next task is checked: one of each :data:`CHECKED` that come back, by chance."""
    while True:
        drawn = random.randrange(CHECKED)
        yield from (number == drawn for number in range(CHECKED))


def liar(
    workers: Workers, scene: bytes, arguments: tuple[str, Frame | None, Part], first: Rendered, second: Rendered
) -> str | None:
    """Which of two workers of one driver has rendered a part otherwise than a third one does, or this machine; None if
    neither has. ``arguments`` are those of the part after the scene.

    Raises
    ------
    FragtracerError
        If there is no third opinion, or that is another one.
    """
    if first.digest == second.digest:
        return None
    third = _third(workers, scene, arguments, first, second)
    if third.digest not in (first.digest, second.digest):
        raise FragtracerError(
            f"{first.worker}, {second.worker} and {third.worker} each render another picture of one block; see "
            "what fragtracer doctor says of them"
        )
    return second.worker if third.digest == first.digest else first.worker


def _third(
    workers: Workers, scene: bytes, arguments: tuple[str, Frame | None, Part], first: Rendered, second: Rendered
) -> Rendered:
    if other := workers.other(first.driver, first.worker, second.worker):
        try:
            found: Rendered = workers.submit(other, *arguments, priority=2).result(timeout=workers.patience)
            if found.driver == first.driver:
                return replace(found, worker=other)
        except Exception as error:  # of that worker
            reason = str(error)
    try:
        own = here.render_part(scene, *arguments, worker="this machine")
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
