# SPDX-License-Identifier: MIT
"""Variants of the shaders that count work or leave something out: edits of shader files, made in a copy of the folder.

So the path tracer itself needs no feature for measurements. An edit names text that occurs exactly once: after a change
of the shaders it fails, and does not measure something else.
"""

import shutil
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from fragtracer.errors import ShaderError
from fragtracer.resources import folder

_PATH = "integrator/path.glsl"
_DIRECT = "integrator/direct.glsl"
_TRANSMITTANCE = (
    "vec3 direct_transmittance(Vertex vertex, Ray ray, float distance, ivec4 inside, int light_primitive, vec2 u) {\n"
)


@dataclass(frozen=True)
class Edit:
    """``text``, which occurs exactly once in ``file`` below shaders/, becomes ``replacement``."""

    file: str
    text: str
    replacement: str


# The image is what a sample takes: path rays in red, shadow rays in green, vertices where a path scatters in blue.
COUNT_WORK = (
    Edit(
        _DIRECT,
        "uniform vec3 u_ambient_radiance;\n",
        "uniform vec3 u_ambient_radiance;\nvec3 sample_work = vec3(0.0);\n",
    ),
    Edit(
        _DIRECT,
        _TRANSMITTANCE,
        _TRANSMITTANCE + "    sample_work.y += 1.0;\n",
    ),
    Edit(
        _PATH,
        "            hit = closest_hit(",
        "            sample_work.x += float(!path.has_ended);\n            hit = closest_hit(",
    ),
    Edit(
        _PATH,
        "        path.throughput /= survival;\n",
        "        path.throughput /= survival;\n        sample_work.z += float(scatters);\n",
    ),
    Edit(
        _PATH,
        "    film_add_if(ends, film, moments_of_path(path.moments, path.radiance));\n",
        "    film_add_if(ends, film, sample_work);\n    if (ends) sample_work = vec3(0.0);\n",
    ),
)

# A path that has ended waits for the vertices of those beside it: the same picture.
NO_PATHS_BEFORE_VERTICES = (
    Edit(_PATH, "bool is_open = u_is_open != 0 && HAS_MEDIA == 0;", "const bool is_open = false;"),
)

# A loop over paths around one over vertices: the same picture, but a pixel waits for the longest path beside it.
NO_PATH_REGENERATION = (
    *NO_PATHS_BEFORE_VERTICES,
    Edit(
        _PATH,
        "    do {\n        // On to the next surface,",
        "    do {\n"
        "        path = path_begin(pixel, sampler_vec4(numbers, index, dimension_camera(), rr_sample));\n"
        "        bool goes_on;\n"
        "        do {\n        // On to the next surface,",
    ),
    Edit(_PATH, "ends ? dimension_camera() : dimension_vertex(vertex_number)", "dimension_vertex(vertex_number)"),
    Edit(
        _PATH,
        "        if (ends) path = path_begin(pixel, u);\n    } while (film.next < end);\n",
        "        goes_on = scatters;\n        } while (goes_on);\n    } while (film.next < end);\n",
    ),
)

# The BSDF once, for the first light sample, times the fraction of all samples that nothing occludes. Biased, since it
# scatters occluded light and the rest alike.
ONE_BSDF_EVALUATION = (
    Edit(_DIRECT, "        int i = 0;\n", "        vec3 unoccluded = vec3(0.0);\n        int i = 0;\n"),
    Edit(
        _DIRECT,
        "            direct += direct_sample(vertex, is_wanted, u);\n",
        "            LightSample light = light_sample(vertex.origin, u);\n"
        "            vec3 wi = frame_to_local(vertex.frame, light.wi);\n"
        "            vec4 eval_pdf = vertex_eval_pdf(vertex, wi);\n"
        "            if (i == 0) unoccluded = direct_unoccluded(vertex, light, wi, eval_pdf);\n"
        "            Ray ray = Ray(vertex_origin(vertex, wi), light.wi);\n"
        "            bool is_reached = is_wanted && light.pdf > 0.0;\n"
        "            if (is_reached && !direct_is_occluded(vertex, ray, light.distance, light.primitive, u)) {\n"
        "                direct += unoccluded;\n"
        "            }\n",
    ),
)


@contextmanager
def edited_shaders(edits: Sequence[Edit]) -> Iterator[Path | None]:
    """A temporary copy of the shader folder with ``edits``, for ``Renderer(shaders=...)``; without edits None, which
    stands for fragtracer's own shaders.

    Raises
    ------
    ShaderError
        If the text of an edit does not occur exactly once.
    """
    if not edits:
        yield None
        return
    with TemporaryDirectory(prefix="fragtracer-") as place:
        root = Path(place) / "shaders"
        shutil.copytree(folder("shaders"), root)
        for edit in edits:
            _apply(edit, root / edit.file)
        yield root


def _apply(edit: Edit, path: Path) -> None:
    source = path.read_text("utf-8")
    if (count := source.count(edit.text)) != 1:
        raise ShaderError(f"{edit.file} has {count} times what a variant replaces once: {edit.text.strip()!r}")
    path.write_text(source.replace(edit.text, edit.replacement), "utf-8")
