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
``fragtracer_texture`` (texture.py), the image of one of those; ``fragtracer_unlit`` (unlit.py), the emitter of
an unlit material; and ``fragtracer_spot`` (spot.py), a spot light.
"""

from functools import lru_cache

from .models.metallic_roughness import DELTA_ALPHA

NAME = "fragtracer_cooktorrance"
SPOT = "fragtracer_spot"
SURFACE = "fragtracer_surface"
TEXTURE = "fragtracer_texture"
UNLIT = "fragtracer_unlit"

__all__ = ["DELTA_ALPHA", "NAME", "SPOT", "SURFACE", "TEXTURE", "UNLIT", "register"]


def register() -> None:
    """Makes the plugins known to the active Mitsuba variant; may be called again."""
    import mitsuba as mi

    _register(mi.variant())


@lru_cache
def _register(variant: str) -> tuple[type, ...]:
    import drjit as dr
    import mitsuba as mi

    from .plain import plain_class
    from .spot import spot_class
    from .surface import surface_class
    from .texture import texture_class
    from .unlit import unlit_class

    factories = (plain_class, surface_class, texture_class, unlit_class, spot_class)
    plugins = tuple(factory(mi, dr) for factory in factories)
    mi.register_bsdf(NAME, plugins[0])
    mi.register_bsdf(SURFACE, plugins[1])
    mi.register_texture(TEXTURE, plugins[2])
    mi.register_emitter(UNLIT, plugins[3])
    mi.register_emitter(SPOT, plugins[4])
    return plugins
