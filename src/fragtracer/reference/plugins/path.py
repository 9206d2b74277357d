# SPDX-License-Identifier: MIT
"""``fragtracer_path``: Mitsuba's ``path`` and ``volpath``, with rays that start nearer to the surface.

Mitsuba's own integrators start rays 9e-5 (1 + the largest coordinate) metres off a surface and end shadow rays a
thousandth short of the light. Here both ends are moved off their surfaces by :data:`RAY_OFFSET` of the largest
coordinate of them and of where the ray before came from; and shadow rays look for the nearest intersection, since
Mitsuba's own test whether a sphere is in the way (``ray_test``) rounds more, and finds the light itself.
Intersections, emitters and materials are Mitsuba's, and the estimator is that of its ``path``: next
event estimation and BSDF sampling with the power heuristic (Veach 1997, "Robust Monte Carlo methods for light
transport simulation", section 9.2.4). As in ``volpath`` null transmission does not count as scattering.

It needs a vectorised variant. The points of a pixel and of the lens are a randomised lattice, each of them uniform and
independent of all other random numbers: the mean is the same, edges are less noisy. All other numbers are those of the
scene's sampler.

Its parameters: ``max_depth`` and ``rr_depth`` as of ``path``, ``hide_emitters`` (the camera sees emitters as
black), ``null_transmission`` (whether some material has it) and ``media`` (whether there are homogeneous ones, which
absorb and do not scatter).
"""

from functools import partial
from typing import Any

# Times 2^32: Roberts 2018, "The unreasonable effectiveness of quasirandom sequences". The rotation: Cranley and
# Patterson 1976, "Randomization of number theoretic methods for multiple integration".
_KRONECKER = (3242174889, 2447445414)
RAY_OFFSET = 2.0**-18  # 64 half units in the last place


def path_class(mi: Any, dr: Any) -> type:
    """The plugin's class for the active variant of Mitsuba ``mi`` with Dr.Jit ``dr``."""

    class Path(mi.ad.integrators.common.ADIntegrator):  # type: ignore[misc]
        def __init__(self, props: Any) -> None:
            super().__init__(props)
            self.max_depth, self.rr_depth = int(props["max_depth"]), int(props["rr_depth"])
            self.hides_emitters = bool(props.get("hide_emitters", False))
            self.null_transmission = bool(props.get("null_transmission", False))
            self.media = bool(props.get("media", False))
            self.medium = None  # that the camera is in

        def prepare(self, sensor: Any, seed: Any = 0, spp: int = 0, aovs: Any = ()) -> Any:
            self.seed, self.medium = seed, sensor.get_medium()
            return super().prepare(sensor, seed, spp, list(aovs))

        def sample_rays(self, scene: Any, sensor: Any, sampler: Any) -> Any:
            return super().sample_rays(scene, sensor, _CameraSampler(sampler, self.seed))

        def sample(self, mode: Any, scene: Any, sampler: Any, ray: Any, active: Any = True, **_: Any) -> Any:
            # Of the last scattering: where, its density, and whether no emitter sample could have been drawn there.
            scattered, pdf, alone = mi.Point3f(ray.o), mi.Float(1), mi.Bool(True)
            seen, depth = mi.Bool(not self.hides_emitters), mi.UInt32(0)
            found = mi.Color3f(0), mi.Color3f(1)
            medium = dr.zeros(mi.MediumPtr) if self.medium is None else mi.MediumPtr(self.medium)
            state = (mi.Bool(active), mi.Ray3f(ray), *found, scattered, pdf, alone, seen, depth, medium, sampler)
            state = dr.while_loop(state, lambda active, *_: active, partial(self._extended, scene))
            return state[2], mi.Bool(True), [], None

        def _extended(
            self,
            scene: Any,
            active: Any,
            ray: Any,
            radiance: Any,
            throughput: Any,
            scattered: Any,
            pdf: Any,
            alone: Any,
            seen: Any,
            depth: Any,
            medium: Any,
            sampler: Any,
        ) -> Any:
            """The path's state after one more segment."""
            context = mi.BSDFContext()
            si = scene.ray_intersect(ray, active)
            throughput *= self._absorbed(medium, si.t, active)
            radiance += throughput * self._emission(scene, si, scattered, pdf, alone, active & seen)

            may_scatter = depth + 1 < self.max_depth
            active &= si.is_valid() & (may_scatter | self.null_transmission)
            bsdf = si.bsdf(mi.RayDifferential3f(ray))
            extent = dr.maximum(dr.max(dr.abs(si.p)), dr.max(dr.abs(ray.o)))

            smooth = active & may_scatter & mi.has_flag(bsdf.flags(), mi.BSDFFlags.Smooth)
            ds, weight = scene.sample_emitter_direction(si, sampler.next_2d(smooth), False, smooth)
            value, bsdf_pdf = bsdf.eval_pdf(context, si, si.to_local(ds.d), smooth)
            weight *= value * dr.select(ds.delta, 1, _power_heuristic(ds.pdf, bsdf_pdf))
            smooth &= (ds.pdf > 0) & (dr.max(weight) > 0)
            weight *= self._absorbed(self._next_medium(medium, si, ds.d), ds.dist, smooth)
            radiance += throughput * weight * self._transmittance(scene, _shadow_ray(si, ds, extent), smooth)

            sampled, weight = bsdf.sample(context, si, sampler.next_1d(active), sampler.next_2d(active), active)
            throughput = dr.select(active, throughput * weight, throughput)
            wi = si.to_world(sampled.wo)
            ray = mi.Ray3f(_offset(si.p, si.n, wi, extent), wi, ray.time, ray.wavelengths)
            medium = self._next_medium(medium, si, wi)
            null = mi.has_flag(sampled.sampled_type, mi.BSDFFlags.Null)
            active &= null | may_scatter
            scatters = active & ~null
            delta = mi.has_flag(sampled.sampled_type, mi.BSDFFlags.Delta)
            scattered = dr.select(scatters, si.p, scattered)
            pdf, alone = dr.select(scatters, sampled.pdf, pdf), dr.select(scatters, delta, alone)
            seen, depth = seen | scatters, dr.select(scatters, depth + 1, depth)

            brightest = dr.max(throughput)
            survival = dr.select(scatters & (depth >= self.rr_depth), dr.minimum(brightest, 1), 1)
            active &= (brightest > 0) & (sampler.next_1d(active) < survival)
            throughput = dr.select(active, throughput / survival, throughput)
            return active, ray, radiance, throughput, scattered, pdf, alone, seen, depth, medium, sampler

        def _emission(self, scene: Any, si: Any, scattered: Any, pdf: Any, alone: Any, active: Any) -> Any:
            """What is emitted where a ray arrives, weighted as a sample of the BSDF."""
            before = dr.zeros(mi.Interaction3f)
            before.p = scattered
            ds = mi.DirectionSample3f(scene, si, before)
            emitter_pdf = dr.select(alone, 0, scene.pdf_emitter_direction(before, ds, active & ~alone))
            return ds.emitter.eval(si, active) * _power_heuristic(pdf, emitter_pdf)

        def _next_medium(self, medium: Any, si: Any, direction: Any) -> Any:
            """What a ray is in that leaves a surface, where it arrived through ``medium``."""
            if not self.media:
                return medium
            return dr.select(si.is_valid() & si.is_medium_transition(), si.target_medium(direction), medium)

        def _absorbed(self, medium: Any, distance: Any, active: Any) -> Any:
            """What a medium leaves of light along a way (Beer and Lambert)."""
            if not self.media:
                return mi.Color3f(1)
            _, _, extinction = medium.get_scattering_coefficients(dr.zeros(mi.MediumInteraction3f), active)
            return dr.select(extinction > 0, dr.exp(-extinction * distance), 1)

        def _transmittance(self, scene: Any, ray: Any, active: Any) -> Any:
            """Of a ray that ends: 0 or 1, or between where a surface has null transmission."""
            if not self.null_transmission:
                return dr.select(active & ~scene.ray_intersect_preliminary(ray, False, active).is_valid(), 1, 0)

            def passed(active: Any, ray: Any, transmittance: Any) -> Any:
                si = scene.ray_intersect(ray, active)
                active &= si.is_valid()
                here = si.bsdf(mi.RayDifferential3f(ray)).eval_null_transmission(si, active)
                transmittance = dr.select(active, transmittance * here, transmittance)
                extent = dr.maximum(dr.max(dr.abs(si.p)), dr.max(dr.abs(ray.o)))
                start, end = _offset(si.p, si.n, ray.d, extent), ray.o + ray.maxt * ray.d
                ray = mi.Ray3f(start, ray.d, dr.dot(end - start, ray.d), ray.time, ray.wavelengths)
                return active & (dr.max(transmittance) > 0) & (ray.maxt > 0), ray, transmittance

            state = active, ray, dr.select(active, mi.Color3f(1), 0)
            return dr.while_loop(state, lambda active, *_: active, passed)[2]

        def to_string(self) -> str:
            return f"FragtracerPath[max_depth={self.max_depth}, rr_depth={self.rr_depth}]"

    class _CameraSampler:
        """The points of each pixel and lens: a Kronecker sequence, rotated by random numbers of each pixel and seed."""

        def __init__(self, sampler: Any, seed: Any) -> None:
            self.sample_count = sampler.sample_count
            index = dr.arange(mi.UInt32, sampler.wavefront_size())
            count = dr.opaque(mi.UInt32, self.sample_count())
            self.pixel, self.number = index // count, index % count
            self.key = dr.opaque(mi.UInt32, seed)

        def next_2d(self) -> Any:
            self.key, salt = mi.sample_tea_32(self.key, 1)
            rotations = mi.sample_tea_32(self.pixel, salt)
            turned = (r + self.number * step for r, step in zip(rotations, _KRONECKER, strict=True))
            return mi.Point2f(*(mi.Float(x >> 8) * 2.0**-24 for x in turned))

    def _offset(point: Any, normal: Any, direction: Any, extent: Any) -> Any:
        """``point`` moved off a surface, to the side that ``direction`` points to."""
        return point + normal * dr.mulsign(RAY_OFFSET * extent, dr.dot(normal, direction))

    def _shadow_ray(si: Any, ds: Any, extent: Any) -> Any:
        """From just off the surface to just off the emitter."""
        origin = _offset(si.p, si.n, ds.d, extent)
        end = _offset(ds.p, ds.n, -ds.d, dr.maximum(extent, dr.max(dr.abs(ds.p))))
        distance = dr.norm(end - origin)
        return mi.Ray3f(origin, (end - origin) / distance, distance, si.time, si.wavelengths)

    def _power_heuristic(pdf: Any, other: Any) -> Any:
        """The weight of a sample of density ``pdf`` that another strategy has with density ``other``."""
        ratio = other / pdf
        return dr.select(pdf > 0, 1 / (1 + ratio * ratio), 0)

    return Path
