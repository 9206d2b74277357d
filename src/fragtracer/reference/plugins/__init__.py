# SPDX-License-Identifier: MIT
"""fragtracer's materials as Mitsuba 3 plugins.

Written from the formulas, independently of the shader, so that an error in one of them shows up as a
difference. The folder needs Mitsuba alone: ``fragtracer export-mitsuba --plugin`` copies it beside a
scene. To use it::

    import mitsuba as mi
    mi.set_variant("llvm_ad_rgb")
    import fragtracer_plugins
    fragtracer_plugins.register()
    scene = mi.load_file("scene.xml")

The plugins: ``fragtracer_cooktorrance`` (plain.py), a uniform material; ``fragtracer_surface``
(surface.py), one with textures, shading normals, alpha or culled back faces, for meshes;
``fragtracer_texture`` (texture.py), the image of one of those; ``fragtracer_blend`` (blend.py), two
materials by a weight; ``fragtracer_rough_pane`` (rough_pane.py), a thin dielectric of facets;
``fragtracer_one_sided`` (one_sided.py), a material without its back;
``fragtracer_unlit`` (unlit.py), the emitter of an unlit material; ``fragtracer_spot`` (spot.py), a spot
light; ``fragtracer_sphere_light`` (sphere_light.py), the emitter of a sphere; and, in variants that are not
scalar, ``fragtracer_path`` (path.py), the integrator, and ``fragtracer_beside`` (beside.py), several pictures of one
sensor.

In scalar variants numbers and masks are Python's: ``x / 0`` is an error there, ``x * dr.rcp(0)`` is infinite, and ``~``
of a mask is an integer.
"""

from functools import lru_cache

from .models.metallic_roughness import DELTA_ALPHA

BESIDE = "fragtracer_beside"
BLEND = "fragtracer_blend"
NAME = "fragtracer_cooktorrance"
ONE_SIDED = "fragtracer_one_sided"
PATH = "fragtracer_path"
ROUGH_PANE = "fragtracer_rough_pane"
SPHERE_LIGHT = "fragtracer_sphere_light"
SPOT = "fragtracer_spot"
SURFACE = "fragtracer_surface"
TEXTURE = "fragtracer_texture"
UNLIT = "fragtracer_unlit"

__all__ = [
    "BESIDE",
    "BLEND",
    "DELTA_ALPHA",
    "NAME",
    "ONE_SIDED",
    "PATH",
    "ROUGH_PANE",
    "SPHERE_LIGHT",
    "SPOT",
    "SURFACE",
    "TEXTURE",
    "UNLIT",
    "register",
]


def register() -> None:
    """Makes the plugins known to the active Mitsuba variant; may be called again."""
    import mitsuba as mi

    _register(mi.variant())


@lru_cache
def _register(variant: str) -> tuple[type, ...]:
    import drjit as dr
    import mitsuba as mi

    from .beside import beside_class
    from .blend import blend_class
    from .one_sided import one_sided_class
    from .path import path_class
    from .plain import plain_class
    from .rough_pane import rough_pane_class
    from .sphere_light import sphere_light_class
    from .spot import spot_class
    from .surface import surface_class
    from .texture import texture_class
    from .unlit import unlit_class

    factories = (plain_class, surface_class, texture_class, unlit_class, spot_class, sphere_light_class, blend_class)
    plugins = tuple(factory(mi, dr) for factory in (*factories, rough_pane_class, one_sided_class))
    mi.register_bsdf(NAME, plugins[0])
    mi.register_bsdf(SURFACE, plugins[1])
    mi.register_texture(TEXTURE, plugins[2])
    mi.register_emitter(UNLIT, plugins[3])
    mi.register_emitter(SPOT, plugins[4])
    mi.register_emitter(SPHERE_LIGHT, plugins[5])
    mi.register_bsdf(BLEND, plugins[6])
    mi.register_bsdf(ROUGH_PANE, plugins[7])
    mi.register_bsdf(ONE_SIDED, plugins[8])
    if dr.is_jit_v(mi.Float):
        plugins += (path_class(mi, dr), beside_class(mi, dr))
        mi.register_integrator(PATH, plugins[-2])
        mi.register_sensor(BESIDE, plugins[-1])
    return plugins
