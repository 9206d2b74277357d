# SPDX-License-Identifier: MIT
"""``fragtracer_one_sided``: the front of the material ``bsdf``; rays from behind pass.

Unless ``passes`` is false: then the back scatters nothing, and rays pass its holes alone, as they do from the front.
"""

from typing import Any


def one_sided_class(mi: Any, dr: Any) -> type:
    """The plugin's class for the active variant of Mitsuba ``mi`` with Dr.Jit ``dr``."""

    null = mi.BSDFFlags.Null

    class OneSided(mi.BSDF):  # type: ignore[misc]
        def __init__(self, props: Any) -> None:
            super().__init__(props)
            self.bsdf = props["bsdf"]
            self.passes = bool(props.get("passes", True))
            passed = [null | mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide] if self.passes else []
            self.m_components = [self.bsdf.flags(i) for i in range(self.bsdf.component_count())] + passed
            self.m_flags = self.bsdf.flags() | (passed[0] if passed else 0)

        def sample(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True) -> Any:
            front = si.wi.z > 0
            if not self.passes:
                scattered, value = self.bsdf.sample(ctx, si, sample1, sample2, active)
                return scattered, dr.select(front | mi.has_flag(scattered.sampled_type, null), value, 0)
            scattered, value = self.bsdf.sample(ctx, si, sample1, sample2, active & front)
            passed = mi.BSDFSample3f(-si.wi)
            passed.pdf, passed.eta = mi.Float(1), mi.Float(1)
            passed.sampled_type, passed.sampled_component = mi.UInt32(int(null)), mi.UInt32(len(self.m_components) - 1)
            return dr.select(front, scattered, passed), dr.select(front, value, mi.Color3f(1))

        def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            front = si.wi.z > 0
            value, pdf = self.bsdf.eval_pdf(ctx, si, wo, active & front)
            return dr.select(front, value, 0), dr.select(front, pdf, 0)

        def eval(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return self.eval_pdf(ctx, si, wo, active)[0]

        def pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return self.eval_pdf(ctx, si, wo, active)[1]

        def eval_null_transmission(self, si: Any, active: Any = True) -> Any:
            if not self.passes:
                return self.bsdf.eval_null_transmission(si, active)
            return dr.select(si.wi.z > 0, mi.Color3f(0), mi.Color3f(1))

        def to_string(self) -> str:
            return f"FragtracerOneSided[{self.bsdf}]"

    return OneSided
