# SPDX-License-Identifier: MIT
"""The moments of a picture while a shutter is open, drawn one after the other."""

from fragtracer.arguments import check_scene
from fragtracer.films import MOST_SAMPLES
from fragtracer.packing.instances import refit
from fragtracer.scene import RenderSettings, Scene
from fragtracer.shutter import Shutter


class Moments:
    """What the samples of a picture of ``scene`` see: without a shutter all the same, which is one moment.

    ``samples`` are those of each pixel in a moment, and ``shown`` is what the GPU holds.
    """

    def __init__(self, scene: Scene, shutter: Shutter | None, settings: RenderSettings) -> None:
        self.shutter = shutter
        self.samples = MOST_SAMPLES if shutter is None else shutter.samples(settings.spp)
        self._scene, self._seed = scene, settings.seed
        self.forget()

    def forget(self) -> None:
        """The GPU holds the scene that was given, and no moment."""
        self.shown, self._number = self._scene, -1

    def begin(self, sample: int) -> bool:
        """Show what a sample sees; whether that is something else."""
        number = sample // self.samples
        if self.shutter is None or number == self._number:
            return False
        self.shown, self._number = self.at(sample), number
        return True

    def at(self, sample: int) -> Scene:
        """What a sample sees."""
        if self.shutter is None:
            return self._scene
        scene = self.shutter.at(self.shutter.time(sample // self.samples, self._seed))
        check_scene(scene)
        for before, after in zip(self._scene.meshes, scene.meshes, strict=False):
            refit(before, after)
        return scene

    def end(self, sample: int) -> int:
        """The number of the first sample after the moment of this one."""
        return sample - sample % self.samples + self.samples

    @property
    def all_seen(self) -> int:
        """Samples per pixel with which a shutter has shown all its moments; 0 without one."""
        return 0 if self.shutter is None else self.shutter.moments * self.samples

    def described(self, spp: int) -> dict[str, str]:
        """For the metadata of a picture of so many samples per pixel."""
        return {} if self.shutter is None else {"shutter": self.shutter.name, "moments": str(-(-spp // self.samples))}
