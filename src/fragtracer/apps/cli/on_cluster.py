# SPDX-License-Identifier: MIT
"""``fragtracer render --cluster``: a picture, or frames, by many machines."""

import sys
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

from fragtracer.apps import cluster
from fragtracer.apps.cli.frames import Frames, exposed_alike, is_finished
from fragtracer.apps.cli.keeping import Keeping
from fragtracer.apps.cli.picture import WRITING, Picture, write_or_rescue
from fragtracer.apps.cli.words import counted, finished_before
from fragtracer.apps.cluster.work import BLOCK
from fragtracer.errors import FragtracerError
from fragtracer.interruption import deferred
from fragtracer.scene import Scene
from fragtracer.scene.content import content_digest

Show = Callable[[dict[str, Any], int], AbstractContextManager[Callable[[Any], None]]]  # as render._progress


def check_options(limits: Mapping[str, Any], picture: Picture, moves: bool, first_sample: int | None) -> None:
    """Raise FragtracerError where a cluster cannot do what is asked for."""
    if first_sample is not None:
        raise FragtracerError("--cluster renders from the first sample; leave out --first-sample")
    if picture.aovs or picture.denoise:
        raise FragtracerError("--cluster renders the picture alone; leave out --aov and --denoise")
    if limits["worst"] is not None:
        raise FragtracerError("--cluster looks at the mean error only; give --until in place of --worst")
    if moves and limits["seconds"] is not None:
        raise FragtracerError("--time is for one picture of a cluster; give --spp or --until for frames")


def render_picture(
    scene: Scene,
    address: str,
    block: int | None,
    limits: dict[str, Any],
    output: Path,
    picture: Picture,
    keeping: Keeping | None,
    show: Show,
) -> bool:
    """Render a picture and write it; False if that was interrupted."""
    bounds = {name: limits[name] for name in ("spp", "seconds", "until")}
    cluster.check(scene, block or BLOCK)
    begin = None if keeping is None else keeping.begin
    with cluster.connected(address) as client, show(limits, scene.render.width * scene.render.height) as report:
        found = cluster.render(scene, client, **bounds, progress=report, block=block or BLOCK, begin=begin)
    if found.interrupted:
        print(WRITING, file=sys.stderr)
    with deferred():
        write_or_rescue(output, found.pixels.mean[..., :3], found.metadata, *picture.look)
    _tell(output, found)
    if found.problem:
        raise FragtracerError(found.problem)
    return not found.interrupted


def render_frames(
    frames: Frames,
    address: str,
    block: int | None,
    limits: dict[str, Any],
    picture: Picture,
    keeping: Keeping | None,
    show: Show,
) -> bool:
    """Render the frames that are not finished, in one queue; False if that was interrupted."""
    block, scene = block or BLOCK, frames.base
    if frames.playing is not None:
        mend = "where an animation plays, leave it out, and give each machine some of the --frames"
        raise FragtracerError(f"--cluster renders frames of a moving camera; {mend}")
    cluster.check(scene, block)
    files = frames.files
    picture.check(files[min(files)])
    frames.make_folder()
    picture = exposed_alike(picture, frames)
    scenes = {number: frames.scene(number) for number in files}
    digests = {
        number: content_digest(
            repr(sorted(cluster.origin_of_frame(moved, block).items())), repr((scene.render.spp, limits, picture))
        )
        for number, moved in scenes.items()
    }
    due = {n: moved for n, moved in scenes.items() if not is_finished(files[n], digests[n])}
    if len(due) < len(files):
        print(finished_before(len(files) - len(due), len(files)))
    if not due:
        return True

    def write(number: int, found: cluster.Picture) -> None:
        more = {"frame": str(number), "frame_digest": digests[number]}
        with deferred():
            write_or_rescue(files[number], found.pixels.mean[..., :3], found.metadata | more, *picture.look)
        _tell(files[number], found)

    pixels = scene.render.width * scene.render.height
    begin = None if keeping is None else lambda render, number: keeping.begin(render, f"{number:04}")
    shown = limits | {"spp": limits["spp"] and limits["spp"] * len(due)}
    with cluster.connected(address) as client, show(shown, pixels) as report:
        try:
            cluster.render_frames(
                scene,
                due,
                client,
                write,
                spp=limits["spp"],
                until=limits["until"],
                progress=report,
                block=block,
                begin=begin,
                count=frames.count,
            )
        except KeyboardInterrupt:
            print("interrupted; the same command renders the frames that are not finished", file=sys.stderr)
            return False
    return True


def _tell(output: Path, found: cluster.Picture) -> None:
    note = ", interrupted" if found.interrupted or found.problem else ""
    error = 100 * found.pixels.relative_error()
    workers = counted(int(found.metadata["workers"]), "worker")
    print(f"{output}: {found.metadata['spp']} samples per pixel of {workers}{note}, {error:.2g} % mean error")
