# SPDX-License-Identifier: MIT
"""``fragtracer_texture``: an image on a mesh as in glTF 2.0, looked up by Mitsuba's own ``bitmap``.

Its parameters: the child ``image``, a ``bitmap`` whose ``wrap_mode`` is "repeat"; ``wrap_u`` and
``wrap_v`` ("repeat", "mirror" or "clamp"), which may differ, as they cannot in Mitsuba; ``uv_offset``
and ``uv_scale`` (two numbers) and ``uv_rotation`` (radians) of KHR_texture_transform;
``factor`` (three numbers), which multiplies the colour; and for the light of a surface with holes the child
``alpha``, another such texture, with ``opacity``, ``alpha_mode`` and ``alpha_cutoff`` as of ``fragtracer_surface``.
"""

import math
from typing import Any


def texture_class(mi: Any, dr: Any) -> type:
    """The plugin's class for the active variant of Mitsuba ``mi`` with Dr.Jit ``dr``."""

    class ImageTexture(mi.Texture):  # type: ignore[misc]
        def __init__(self, props: Any) -> None:
            super().__init__(props)
            self.image = props["image"]
            self.factor = mi.Color3f([float(x) for x in props.get("factor", [1.0, 1.0, 1.0])])
            self.wraps = str(props.get("wrap_u", "repeat")), str(props.get("wrap_v", "repeat"))
            self.offset = [float(x) for x in props.get("uv_offset", [0.0, 0.0])][:2]
            self.scale = [float(x) for x in props.get("uv_scale", [1.0, 1.0])][:2]
            self.rotation = float(props.get("uv_rotation", 0.0))
            self.alpha = props.get("alpha", None)
            self.opacity = float(props.get("opacity", 1.0))
            cutoff, is_mask = float(props.get("alpha_cutoff", 0.5)), props.get("alpha_mode", "blend") == "mask"
            self.cutoff = cutoff if is_mask else None

        def at(self, si: Any, uv: Any, active: Any = True) -> Any:
            """The colour at texture coordinates ``uv``, Color3f."""
            color = self.image.eval_3(self._moved(si, uv), active) * self.factor
            if self.alpha is None:
                return color
            alpha = self.opacity * self.alpha.number_at(si, uv, active)
            return color * (alpha if self.cutoff is None else dr.select(alpha >= self.cutoff, mi.Float(1), 0))

        def number_at(self, si: Any, uv: Any, active: Any = True) -> Any:
            """The value of an image of one channel at texture coordinates ``uv``."""
            return self.image.eval_1(self._moved(si, uv), active)

        def eval(self, si: Any, active: Any = True) -> Any:
            return self.at(si, si.uv, active)

        def eval_3(self, si: Any, active: Any = True) -> Any:
            return self.at(si, si.uv, active)

        def eval_1(self, si: Any, active: Any = True) -> Any:
            return dr.mean(self.at(si, si.uv, active))

        def mean(self) -> Any:
            return self.image.mean() * dr.mean(self.factor)

        def max(self) -> float:
            return float(self.image.max()) * max(float(x) for x in dr.ravel(self.factor))

        def is_spatially_varying(self) -> bool:
            """Untrue, so that an area emitter draws points of the mesh, and not points of the image: several
            places of a mesh may have the same texture coordinates."""
            return False

        def to_string(self) -> str:
            return f"FragtracerTexture[wraps={self.wraps}, image={self.image}]"

        def _moved(self, si: Any, uv: Any) -> Any:
            """``si`` with the coordinates of the lookup, which only an axis that repeats leaves outside [0, 1]."""
            c, s = math.cos(self.rotation), math.sin(self.rotation)
            x, y = uv.x * self.scale[0], uv.y * self.scale[1]
            u, v = c * x + s * y + self.offset[0], c * y - s * x + self.offset[1]
            size = self.image.resolution()
            moved = mi.SurfaceInteraction3f(si)
            moved.uv = mi.Point2f(_wrapped(u, self.wraps[0], size[0]), _wrapped(v, self.wraps[1], size[1]))
            return moved

    def _wrapped(x: Any, wrap: str, texels: Any) -> Any:
        if wrap == "repeat":
            return x
        if wrap == "mirror":
            x = 1 - dr.abs(x - 2 * dr.floor(x / 2) - 1)
        # Half a texel from the edge the outermost texel is all there is, mirrored or clamped alike.
        margin = mi.Float(0.5) / texels
        return dr.clip(x, margin, 1 - margin)

    return ImageTexture
