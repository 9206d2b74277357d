# SPDX-License-Identifier: MIT
"""The shader files behind each part of the library, in the order in which they are included."""

CORE = [f"core/{name}.glsl" for name in ("constants", "math", "frame", "hash", "warp")]
SAMPLER = [*CORE, "sampler/sampler.glsl"]
BSDF = [*CORE, *(f"bsdf/{name}.glsl" for name in ("fresnel", "ggx", "cook_torrance"))]
SHAPE = [
    *CORE,
    "generated/scene_layout.glsl",
    "texture/texture.glsl",
    *(
        f"shape/{name}.glsl"
        for name in (
            "ray",
            "sphere",
            "plane",
            "rectangle",
            "triangle",
            "mesh",
            "intersect",
            "surface",
            "material",
            "alpha",
        )
    ),
]
EMITTERS = ("sphere_light", "area_light", "mesh_light", "sun_light", "environment", "light")
EMITTER = [*SHAPE, *(f"emitter/{name}.glsl" for name in EMITTERS)]
CAMERA = [*CORE, "shape/ray.glsl", "camera/thin_lens.glsl"]
