# SPDX-License-Identifier: MIT
"""``fragtracer_blend``: two materials blended by a weight.

Its parameters: the materials ``bsdf_0`` and ``bsdf_1``; ``weight``, that of the second; and the child
``weight_texture``, a ``fragtracer_texture`` that multiplies it. Mitsuba's own ``blendbsdf`` adds the probability of a
delta reflection to the densities of smooth lobes (3.9), so that a blend with glass or a mirror is too dark: here each
lobe that is a delta stays one.
"""

from typing import Any


def blend_class(mi: Any, dr: Any) -> type:
    """The plugin's class for the active variant of Mitsuba ``mi`` with Dr.Jit ``dr``."""

    class Blend(mi.BSDF):  # type: ignore[misc]
        def __init__(self, props: Any) -> None:
            super().__init__(props)
            self.parts = props["bsdf_0"], props["bsdf_1"]
            self.weight, self.texture = mi.Float(float(props["weight"])), props.get("weight_texture", None)
            self.m_components = [part.flags(i) for part in self.parts for i in range(part.component_count())]
            self.m_flags = self.parts[0].flags() | self.parts[1].flags()
            dr.make_opaque(self.weight)

        def sample(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True) -> Any:
            weight = self._weight_at(si, active)
            second = sample1 < weight
            rest = dr.select(second, sample1, sample1 - weight) * dr.rcp(dr.select(second, weight, 1 - weight))
            (bs_0, value_0), (bs_1, value_1) = (
                part.sample(ctx, si, rest, sample2, active & chosen)
                for part, chosen in zip(self.parts, (sample1 >= weight, second), strict=True)
            )
            bs, value = dr.select(second, bs_1, bs_0), dr.select(second, value_1, value_0)
            bs.sampled_component += dr.select(second, self.parts[0].component_count(), 0)
            smooth = mi.has_flag(bs.sampled_type, mi.BSDFFlags.Smooth)
            pdf = self.pdf(ctx, si, bs.wo, active & smooth)
            bs.pdf = dr.select(smooth, pdf, bs.pdf * dr.select(second, weight, 1 - weight))
            return bs, value

        def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            weight = self._weight_at(si, active)
            (value_0, pdf_0), (value_1, pdf_1) = (part.eval_pdf(ctx, si, wo, active) for part in self.parts)
            return dr.lerp(value_0, value_1, weight), dr.lerp(pdf_0, pdf_1, weight)

        def eval(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return self.eval_pdf(ctx, si, wo, active)[0]

        def pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return self.eval_pdf(ctx, si, wo, active)[1]

        def eval_null_transmission(self, si: Any, active: Any = True) -> Any:
            first, second = (part.eval_null_transmission(si, active) for part in self.parts)
            return dr.lerp(first, second, self._weight_at(si, active))

        def to_string(self) -> str:
            return f"FragtracerBlend[{self.parts[0]}, {self.parts[1]}]"

        def _weight_at(self, si: Any, active: Any) -> Any:
            """Of the second material."""
            if self.texture is None:
                return self.weight
            return dr.clip(self.weight * self.texture.number_at(si, si.uv, active), 0, 1)

    return Blend
