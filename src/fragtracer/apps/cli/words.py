# SPDX-License-Identifier: MIT
"""Words of messages."""


def counted(count: int, noun: str) -> str:
    """As "1 frame" and "2 frames"."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def finished_before(done: int, count: int) -> str:
    """What is said of frames that are not rendered again."""
    return f"{done} of {counted(count, 'frame')} {'was' if done == 1 else 'were'} finished before"
