# SPDX-License-Identifier: MIT
"""What a scene file says of its materials that has no effect."""

from collections.abc import Iterator

from fragtracer.io.toml.tables import join, show, suggest
from fragtracer.scene import SHAPES, Scene


def unused(scene: Scene) -> Iterator[str]:
    """A sentence for each material whose textures nothing shows, or that replaces none of a model."""
    parts = [(mesh, part) for mesh in scene.meshes for part in mesh.parts]
    on_meshes = {used for mesh, part in parts for used in scene.blended(mesh.material_of(part))}
    shapes = (shape for kind in SHAPES for shape in getattr(scene, kind))
    on_shapes = {used for shape in shapes for used in scene.blended(shape.material)}
    of_models = {part.material for _, part in parts}
    models = {name.partition("/")[0] for name in of_models if "/" in name}
    for name, material in scene.materials.items():
        path = join("material", name)
        if material.textures and name in on_shapes - on_meshes:
            keys = ", ".join(f"{key}_texture" for key in material.textures)
            yield f"{path}: ignored: {keys}; only meshes have texture coordinates, and none has this material"
        model = name.partition("/")[0]
        if model in models and name not in of_models | on_shapes | on_meshes:
            own = [other for other in of_models if other.startswith(f"{model}/")]
            yield f"{path}: ignored: the model {show(model)} has no such material; {suggest(name, own)}"
