# SPDX-License-Identifier: MIT
"""Assembles a GLSL program from files: includes, feature defines and the way back from a driver's
line numbers to the file that a person edits."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from fragtracer.errors import ShaderError

# Every define that shader source may test. Values are whole numbers; the composer writes all of
# them, so a name that is tested but not listed here is a slip of the pen.
CONSTANTS = {
    "GEOMETRY_SMITH": 0,
    "GEOMETRY_SCHLICK_BECKMANN": 1,
    "GEOMETRY_KARIS": 2,
    "GEOMETRY_KARIS_ENVIRONMENT": 3,
    "INTEGRATOR_PATH": 0,
    "INTEGRATOR_SPLIT_SUM": 1,
    # How far the split-sum integrator goes from direct light to its approximation, one error after the other.
    "SPLIT_SUM_OCCLUDED": 1,
    "SPLIT_SUM_UNOCCLUDED": 2,
    "SPLIT_SUM_MASKING": 3,
    "SPLIT_SUM_DIFFUSE": 4,
    "SPLIT_SUM_FACTORS": 5,
    "SPLIT_SUM_NORMAL_VIEW": 6,
    "SPLIT_SUM_FRESNEL": 7,
    "SPLIT_SUM_LOOKUPS": 8,
    "SPLIT_SUM_OCCLUSION_MAP": 9,
    "BACKGROUND_ENVIRONMENT": 0,
    "BACKGROUND_PREFILTERED": 1,
    "BACKGROUND_IRRADIANCE": 2,
    "BACKGROUND_BLACK": 3,
    "ESTIMATOR_MIS": 0,
    "ESTIMATOR_NEE": 1,
    "ESTIMATOR_BSDF": 2,
    "SAMPLER_TEXTURE": 0,
    "SAMPLER_HASH": 1,
    "PIXEL_FILTER_BOX": 0,
    "PIXEL_FILTER_TENT": 1,
    "PIXEL_FILTER_GAUSSIAN": 2,
    "LIGHT_POINT": 0,
    "LIGHT_SPHERE": 1,
    "LIGHT_RECTANGLE": 2,
    "LIGHT_TRIANGLE": 3,
    "LIGHT_SUN": 4,
    "LIGHT_ENVIRONMENT": 5,
    "LIGHT_MESH": 6,  # all triangles of meshes that emit
    "MESH_NODE": 0,
    "MESH_TRIANGLE": 1,
    "MESH_INSTANCE": 2,
    "ALPHA_OPAQUE": 0,
    "ALPHA_MASK": 1,
    "ALPHA_BLEND": 2,
    "TEXTURE_SRGB": 1,  # flags of a texture
    "TEXTURE_FLOAT": 2,
    "TEXTURE_NEAREST": 4,
    "WRAP_REPEAT": 0,
    "WRAP_MIRROR": 1,
    "WRAP_CLAMP": 2,
    "AUXILIARY_NONE": 0,
    "AUXILIARY_NORMALS": 1,
    "AUXILIARY_DEPTH": 2,
    "AUXILIARY_ALBEDO": 3,
    # Of display.frag.
    "TONE_LINEAR": 0,
    "TONE_REINHARD": 1,
    "TONE_ACES": 2,
    "TONE_AGX": 3,
    "VIEW_RADIANCE": 0,
    "VIEW_SAMPLES": 1,
    "VIEW_ERROR": 2,
    "VIEW_NON_FINITE": 3,
    "VIEW_DATA": 4,  # the mean is to be shown as it is
    "VIEW_DEPTH": 5,
    "VIEW_ALBEDO": 6,
    "VIEW_BLOOM": 7,
    # Of display_bloom.frag.
    "BLOOM_BRIGHT": 0,
    "BLOOM_HALF": 1,
    "BLOOM_ADD": 2,
    "BLOOM_BLUR_X": 3,
    "BLOOM_BLUR_Y": 4,
}
FEATURES = {
    "GEOMETRY_TERM": CONSTANTS["GEOMETRY_SMITH"],
    "MULTIPLE_SCATTERING": 0,  # its share of the specular lobe, for Smith's geometry term
    "INTEGRATOR": CONSTANTS["INTEGRATOR_PATH"],
    "SPLIT_SUM_STEP": CONSTANTS["SPLIT_SUM_OCCLUSION_MAP"],
    "BACKGROUND": CONSTANTS["BACKGROUND_ENVIRONMENT"],
    "HAS_SPLIT_SUM_MAPS": 0,
    "ESTIMATOR": CONSTANTS["ESTIMATOR_MIS"],
    "SAMPLER": CONSTANTS["SAMPLER_TEXTURE"],
    "PIXEL_FILTER": CONSTANTS["PIXEL_FILTER_BOX"],
    "PATH_REGENERATION": 1,
    "COUNT_WORK": 0,  # the image is the number of path rays, shadow rays and vertices of a sample
    "SINGLE_LIGHT_EVALUATION": 0,  # a biased shortcut, to be measured (integrator/path.glsl)
    "RANDOM_TEXTURE_WIDTH": 64,
    "RANDOM_TEXTURE_LAYERS": 16,
    "SCENE_IN_UNIFORMS": 1,  # else in a texture, for scenes too large for a uniform block
    "SCENE_TEXELS": 1,
    "SPHERE_COUNT": 0,
    "PLANE_COUNT": 0,
    "RECTANGLE_COUNT": 0,
    "TRIANGLE_COUNT": 0,
    "LIGHT_COUNT": 0,
    "HAS_MAPS": 0,  # textures, or colours of vertices
    "HAS_ALPHA": 0,
    "HAS_UNLIT": 0,
    "HAS_ALBEDO_TEXTURE": 0,
    "HAS_ROUGHNESS_TEXTURE": 0,
    "HAS_METALLIC_TEXTURE": 0,
    "HAS_METALLIC_ROUGHNESS": 0,  # one lookup serves both, in two channels
    "HAS_NORMAL_TEXTURE": 0,
    "HAS_EMISSION_TEXTURE": 0,
    "HAS_OCCLUSION_TEXTURE": 0,
    "HAS_TEXTURES": 0,
    "HAS_BYTE_TEXTURES": 0,
    "HAS_FLOAT_TEXTURES": 0,
    "HAS_AMBIENT": 0,
    "HAS_LENS": 0,
    "HAS_DIFFUSE": 1,
    "HAS_SPECULAR": 1,
    "HAS_GLOSSY": 1,
    "HAS_DELTA": 1,
    "HAS_POINT_LIGHT": 0,
    "HAS_SPHERE_LIGHT": 0,
    "HAS_AREA_LIGHT": 0,
    "HAS_SUN": 0,
    "HAS_ENVIRONMENT": 0,
    "HAS_BACKGROUND": 0,
    "SUN_LIGHT": 0,  # the index of each among the lights
    "ENVIRONMENT_LIGHT": 0,
    "HAS_MESHES": 0,
    "HAS_INSTANCES": 0,  # meshes with a matrix of their own that share their triangles
    "HAS_MESH_LIGHT": 0,
    "HAS_CULLING": 0,  # triangles that are not there for rays from behind
    "HAS_SHADING_NORMALS": 0,
    "HAS_UV": 0,
    "HAS_UV_1": 0,
    "HAS_TANGENTS": 0,
    "HAS_COLORS": 0,
    "MESH_STACK": 1,  # entries
    "MESH_LIGHT_COUNT": 0,  # triangles that emit
    "MESH_VERTEX_TEXELS": 0,
    "AUXILIARY": CONSTANTS["AUXILIARY_NONE"],  # else numbers about what is seen, not its light
    # Of display.frag.
    "TONE_CURVE": CONSTANTS["TONE_LINEAR"],
    "VIEW": CONSTANTS["VIEW_RADIANCE"],
    "FILM_FITS": 1,  # the film has a texel for each pixel of the picture
    "HAS_GAMMA": 0,
    "HAS_BLOOM": 0,
    "BLOOM_PASS": CONSTANTS["BLOOM_BRIGHT"],
    "BLOOM_RADIUS": 2,  # taps of a blur to one side
    "HAS_HELD": 0,
    "HAS_OTHER": 0,
}
LANGUAGES = {
    "330 core": "#version 330 core\n",
    "300 es": "#version 300 es\n",
}
_PRECISION = "precision highp float;\nprecision highp int;\nprecision highp sampler2D;\nprecision highp sampler3D;\n"

_INCLUDE = re.compile(r'^\s*#\s*include\s+"([^"]+)"\s*(?://.*)?$')
_UNIFORM = re.compile(r"^uniform\s+(?:highp\s+)?(\w+)\s+(\w+)\s*;")
_CONDITION = re.compile(r"^\s*#\s*(?:if|ifdef|ifndef|elif)\b(.*?)(?://.*)?$")
_NAME = re.compile(r"\b[A-Za-z_]\w*\b")
# Mesa "0:3(11)", NVIDIA "0(3)", Apple, ANGLE and glslang "ERROR: 0:3:".
_DRIVER_LINE = re.compile(r"(?:(?<=ERROR: )|(?<=WARNING: )|^)\d+(?::(\d+)(?:\((\d+)\))?|\((\d+)\))", re.MULTILINE)


@dataclass(frozen=True)
class ShaderSource:
    """GLSL text ready for the driver; ``lines[i]`` is where line i + 1 of it came from."""

    text: str
    lines: tuple[str, ...]

    def translate(self, log: str) -> str:
        """A driver's log with its line numbers replaced by ``file:line``."""

        def place(match: re.Match[str]) -> str:
            number = int(match[1] or match[3])
            known = 1 <= number <= len(self.lines)
            return self.lines[number - 1] if known else match[0]

        return _DRIVER_LINE.sub(place, log)


def compose(
    program: str,
    defines: Mapping[str, int],
    root: Path,
    generated: Mapping[str, str] | None = None,
    constants: Mapping[str, object] | None = None,
    language: str = "330 core",
) -> ShaderSource:
    """Assemble ``program`` with everything it includes.

    Parameters
    ----------
    program
        Path of the top file, relative to ``root``.
    defines
        Values for some of :data:`FEATURES`; the others keep their defaults.
    root
        The folder that includes are relative to.
    generated
        Text for includes that are made in memory, by path.
    constants
        Values for uniforms that shall be compiled into the program instead: numbers, or sequences
        of numbers for vectors and (column by column) matrices.
    language
        One of :data:`LANGUAGES`.

    Raises
    ------
    ShaderError
        On a missing or cyclic include, a define nobody knows, or a condition that tests one.
    """
    unknown = sorted(set(defines) - set(FEATURES))
    if unknown:
        raise ShaderError(f"unknown shader define {unknown[0]}; known are {', '.join(sorted(FEATURES))}")
    values = CONSTANTS | FEATURES | dict(defines)
    header = LANGUAGES[language] + _PRECISION + "".join(f"#define {k} {v}\n" for k, v in values.items())
    text = header.splitlines()
    places = [f"(header):{i + 1}" for i in range(len(text))]
    for place, line in _expand(program, root, generated or {}, set(), ()):
        places.append(place)
        text.append(_freeze(line, constants or {}))
    return ShaderSource("\n".join(text) + "\n", tuple(places))


def _expand(
    path: str, root: Path, generated: Mapping[str, str], done: set[str], stack: tuple[str, ...]
) -> Iterator[tuple[str, str]]:
    """The lines of ``path`` and, in their place, of what it includes, each file once."""
    if path in stack:
        raise ShaderError("cyclic include: " + " -> ".join([*stack[stack.index(path) :], path]))
    if path in done:
        return
    done.add(path)
    source = generated[path] if path in generated else _read(path, root, stack)
    for number, line in enumerate(source.splitlines(), 1):
        place = f"{path}:{number}"
        if include := _INCLUDE.match(line):
            yield from _expand(include[1], root, generated, done, (*stack, path))
            continue
        _check_condition(line, place)
        yield place, line


def _read(path: str, root: Path, stack: tuple[str, ...]) -> str:
    try:
        return (root / path).read_text(encoding="utf-8")
    except OSError as error:
        origin = f" (included from {stack[-1]})" if stack else ""
        raise ShaderError(f"cannot read shader file {path}{origin}: {error.strerror}") from None


def _freeze(line: str, constants: Mapping[str, object]) -> str:
    """``line``, or the definition of a constant where it declares one of those uniforms."""
    uniform = _UNIFORM.match(line)
    if uniform is None or uniform[2] not in constants:
        return line
    value = constants[uniform[2]]
    numbers = ", ".join(map(str, value if isinstance(value, list | tuple) else [value]))
    suffix = "u" if uniform[1] == "uint" else ""
    return f"const {uniform[1]} {uniform[2]} = {uniform[1]}({numbers}{suffix});" + line[uniform.end() :]


def _check_condition(line: str, place: str) -> None:
    """A misspelt name in #if counts as 0 and compiles without a word: refuse it here."""
    if not (condition := _CONDITION.match(line)):
        return
    for name in _NAME.findall(condition[1]):
        if name != "defined" and name not in FEATURES and name not in CONSTANTS:
            raise ShaderError(f"{place}: unknown define {name} in a condition; known are {', '.join(sorted(FEATURES))}")
