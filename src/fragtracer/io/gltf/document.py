# SPDX-License-Identifier: MIT
"""The parts of a glTF 2.0 document that fragtracer reads, with the names and limits of the specification."""

import json
import math
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError
from pydantic_core import ErrorDetails

from fragtracer.scene.fields import LARGEST
from fragtracer.scene.material import FilmIndex, FilmThickness

_LIMITS = {"gt": "greater than", "ge": "at least", "lt": "less than", "le": "at most"}
_LIMITS |= {"min_length": "at least", "max_length": "at most"}
_KINDS = {
    **dict.fromkeys(("model_type", "dict_type"), "an object"),
    **dict.fromkeys(("list_type", "tuple_type"), "an array"),
    **dict.fromkeys(("int_type", "int_from_float", "int_parsing", "int_parsing_size"), "a whole number"),
    **dict.fromkeys(("float_type", "float_parsing"), "a number"),
    **dict.fromkeys(("bool_type", "bool_parsing"), "true or false"),
    "string_type": "a string",
}

Index = Annotated[int, Field(ge=0, le=2**31)]
Count = Annotated[int, Field(ge=0, le=2**53)]
Number = Annotated[float, Field(ge=-LARGEST, le=LARGEST)]
# Exporters round: 1.0000001 is 1.
Fraction = Annotated[float, Field(ge=-1e-4, le=1.0001), AfterValidator(lambda value: min(max(value, 0.0), 1.0))]
Positive = Annotated[float, Field(ge=0, le=LARGEST)]
Color = tuple[Fraction, Fraction, Fraction]
Vector = tuple[Number, Number, Number]


class Item(BaseModel):
    """A JSON object; what is not named here is not read."""

    model_config = ConfigDict(extra="ignore", allow_inf_nan=False)
    extensions: dict[str, Any] = {}


class Asset(Item):
    version: str
    minVersion: Literal["2.0"] = "2.0"


class Buffer(Item):
    byteLength: Count
    uri: str | None = None


class BufferView(Item):
    buffer: Index
    byteOffset: Count = 0
    byteLength: Count
    byteStride: Annotated[int, Field(ge=1, le=252)] | None = None


class SparseIndices(Item):
    bufferView: Index
    byteOffset: Count = 0
    componentType: Literal[5121, 5123, 5125]


class SparseValues(Item):
    bufferView: Index
    byteOffset: Count = 0


class Sparse(Item):
    count: Count
    indices: SparseIndices
    values: SparseValues


class Accessor(Item):
    bufferView: Index | None = None
    byteOffset: Count = 0
    componentType: Literal[5120, 5121, 5122, 5123, 5125, 5126]
    normalized: bool = False
    count: Count
    type: Literal["SCALAR", "VEC2", "VEC3", "VEC4", "MAT2", "MAT3", "MAT4"]
    sparse: Sparse | None = None


class Image(Item):
    uri: str | None = None
    bufferView: Index | None = None


class Sampler(Item):
    magFilter: int = 9729
    wrapS: Literal[33071, 33648, 10497] = 10497
    wrapT: Literal[33071, 33648, 10497] = 10497


class Texture(Item):
    sampler: Index | None = None
    source: Index | None = None


class TextureInfo(Item):
    index: Index
    texCoord: Index = 0
    scale: Number = 1.0  # of normal textures
    strength: Fraction = 1.0  # of occlusion textures


class MetallicRoughness(Item):
    baseColorFactor: tuple[Fraction, Fraction, Fraction, Fraction] = (1.0, 1.0, 1.0, 1.0)
    baseColorTexture: TextureInfo | None = None
    metallicFactor: Fraction = 1.0
    roughnessFactor: Fraction = 1.0
    metallicRoughnessTexture: TextureInfo | None = None


class Ior(Item):
    ior: Positive = 1.5


class Transmission(Item):
    transmissionFactor: Fraction = 0.0
    transmissionTexture: TextureInfo | None = None


class Dispersion(Item):
    dispersion: Positive = 0.0  # 20 over the Abbe number


class Anisotropy(Item):
    anisotropyStrength: Fraction = 0.0
    anisotropyRotation: Number = 0.0  # radians
    anisotropyTexture: TextureInfo | None = None


class Clearcoat(Item):
    clearcoatFactor: Fraction = 0.0
    clearcoatTexture: TextureInfo | None = None
    clearcoatRoughnessFactor: Fraction = 0.0
    clearcoatRoughnessTexture: TextureInfo | None = None
    clearcoatNormalTexture: TextureInfo | None = None


class Sheen(Item):
    sheenColorFactor: tuple[Fraction, Fraction, Fraction] = (0.0, 0.0, 0.0)
    sheenColorTexture: TextureInfo | None = None
    sheenRoughnessFactor: Fraction = 0.0
    sheenRoughnessTexture: TextureInfo | None = None


class Iridescence(Item):
    iridescenceFactor: Fraction = 0.0
    iridescenceTexture: TextureInfo | None = None
    iridescenceIor: FilmIndex = 1.3
    iridescenceThicknessMinimum: FilmThickness = 100.0  # nm
    iridescenceThicknessMaximum: FilmThickness = 400.0
    iridescenceThicknessTexture: TextureInfo | None = None


class DiffuseTransmission(Item):
    diffuseTransmissionFactor: Fraction = 0.0
    diffuseTransmissionTexture: TextureInfo | None = None
    diffuseTransmissionColorFactor: tuple[Fraction, Fraction, Fraction] = (1.0, 1.0, 1.0)
    diffuseTransmissionColorTexture: TextureInfo | None = None


class Volume(Item):
    thicknessFactor: Positive = 0.0
    thicknessTexture: TextureInfo | None = None
    attenuationDistance: Annotated[float, Field(gt=0)] = math.inf
    attenuationColor: tuple[Fraction, Fraction, Fraction] = (1.0, 1.0, 1.0)


class Specular(Item):
    specularFactor: Fraction = 1.0
    specularColorFactor: tuple[Positive, Positive, Positive] = (1.0, 1.0, 1.0)
    specularTexture: TextureInfo | None = None
    specularColorTexture: TextureInfo | None = None


class SpecularGlossiness(Item):
    diffuseFactor: tuple[Fraction, Fraction, Fraction, Fraction] = (1.0, 1.0, 1.0, 1.0)
    diffuseTexture: TextureInfo | None = None
    specularFactor: Color = (1.0, 1.0, 1.0)
    glossinessFactor: Fraction = 1.0
    specularGlossinessTexture: TextureInfo | None = None


class EmissiveStrength(Item):
    emissiveStrength: Positive = 1.0


class Material(Item):
    name: str = ""
    pbrMetallicRoughness: MetallicRoughness = MetallicRoughness()
    normalTexture: TextureInfo | None = None
    occlusionTexture: TextureInfo | None = None
    emissiveTexture: TextureInfo | None = None
    # At most 1 by the specification; what exporters wrote before there was KHR_materials_emissive_strength is not.
    emissiveFactor: tuple[Positive, Positive, Positive] = (0.0, 0.0, 0.0)
    alphaMode: Literal["OPAQUE", "MASK", "BLEND"] = "OPAQUE"
    alphaCutoff: Positive = 0.5
    doubleSided: bool = False


class TextureTransform(Item):
    offset: tuple[Number, Number] = (0.0, 0.0)
    rotation: Number = 0.0
    scale: tuple[Number, Number] = (1.0, 1.0)
    texCoord: Index | None = None


class Primitive(Item):
    attributes: dict[str, Index]
    indices: Index | None = None
    material: Index | None = None
    mode: Annotated[int, Field(ge=0, le=6)] = 4
    targets: list[dict[str, Index]] = []


class Mesh(Item):
    primitives: list[Primitive]
    weights: list[Number] = []


class Node(Item):
    name: str = ""
    children: list[Index] = []
    mesh: Index | None = None
    camera: Index | None = None
    skin: Index | None = None
    weights: list[Number] | None = None
    matrix: Annotated[list[Number], Field(min_length=16, max_length=16)] | None = None
    translation: Vector = (0.0, 0.0, 0.0)
    rotation: tuple[Number, Number, Number, Number] = (0.0, 0.0, 0.0, 1.0)
    scale: Vector = (1.0, 1.0, 1.0)


class Skin(Item):
    inverseBindMatrices: Index | None = None
    joints: list[Index]


class Perspective(Item):
    yfov: Annotated[float, Field(gt=0, lt=3.14159)]
    aspectRatio: Annotated[float, Field(gt=0, le=LARGEST)] | None = None


class Camera(Item):
    type: Literal["perspective", "orthographic"]
    perspective: Perspective | None = None


class Scene(Item):
    nodes: list[Index] = []


class Spot(Item):
    innerConeAngle: Annotated[float, Field(ge=0, le=1.5709)] = 0.0
    outerConeAngle: Annotated[float, Field(gt=0, le=1.5709)] = 0.7853981633974483  # at most π/2, as exporters round it


class Draco(Item):
    bufferView: Index
    attributes: dict[str, Index]


class Meshopt(Item):
    buffer: Index
    byteOffset: Count = 0
    byteLength: Count
    byteStride: Annotated[int, Field(ge=1, le=256)]
    count: Count
    mode: Literal["ATTRIBUTES", "TRIANGLES", "INDICES"]
    filter: Literal["NONE", "OCTAHEDRAL", "QUATERNION", "EXPONENTIAL", "COLOR"] = "NONE"


class MeshoptBuffer(Item):
    fallback: bool = False  # what is in the buffer is there compressed, and the buffer may have no data


class InstanceAttributes(Item):
    TRANSLATION: Index | None = None
    ROTATION: Index | None = None
    SCALE: Index | None = None


class Instancing(Item):
    attributes: InstanceAttributes


class PunctualLight(Item):
    type: Literal["point", "directional", "spot"]
    color: tuple[Positive, Positive, Positive] = (1.0, 1.0, 1.0)
    intensity: Positive = 1.0
    range: Positive | None = None
    spot: Spot = Spot()


class PunctualLights(Item):
    lights: list[PunctualLight] = []


class NodeLight(Item):
    light: Index


class AnimationTarget(Item):
    node: Index | None = None
    path: str


class AnimationChannel(Item):
    sampler: Index
    target: AnimationTarget


class AnimationSampler(Item):
    input: Index
    output: Index
    interpolation: Literal["LINEAR", "STEP", "CUBICSPLINE"] = "LINEAR"


class Animation(Item):
    channels: list[AnimationChannel]
    samplers: list[AnimationSampler]


class Document(Item):
    asset: Asset
    extensionsUsed: list[str] = []
    extensionsRequired: list[str] = []
    buffers: list[Buffer] = []
    bufferViews: list[BufferView] = []
    accessors: list[Accessor] = []
    images: list[Image] = []
    samplers: list[Sampler] = []
    textures: list[Texture] = []
    materials: list[Material] = []
    meshes: list[Mesh] = []
    nodes: list[Node] = []
    cameras: list[Camera] = []
    scenes: list[Scene] = []
    scene: Index | None = None
    skins: list[Skin] = []
    animations: list[Any] = []  # validated when they are asked for: a model is read without, too


def first_mistake(error: ValidationError) -> str:
    """Where the first mistake in a document is, and what it is."""
    detail = error.errors(include_url=False)[0]
    place = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in detail["loc"]).removeprefix(".")
    return f"{place}: {_sentence(detail)}" if place else _sentence(detail)


def _sentence(detail: ErrorDetails) -> str:
    kind, value = detail["type"], detail["input"]
    if kind == "missing":
        return "is missing"
    # To three digits: some limits leave room for rounding.
    limits = [f"{_LIMITS[k]} {round(x, 3) + 0:.15g}" for k, x in detail.get("ctx", {}).items() if k in _LIMITS]
    if kind in ("too_short", "too_long"):
        return f"must have {limits[0]} elements, not {len(value)}"
    wanted = _KINDS.get(kind) or "".join(limits) or detail["msg"].removeprefix("Input should be ")
    return f"must be {wanted}" + ("" if isinstance(value, (dict, list)) else f", got {json.dumps(value)[:60]}")
