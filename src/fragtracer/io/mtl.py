# SPDX-License-Identifier: MIT
"""Material libraries of OBJ files: the Phong model of Wavefront, and its extension for PBR.

A Phong exponent Ns becomes a GGX alpha² = 2 / (Ns + 2), and Ks a factor of the reflectance of a dielectric, or that
reflectance itself where ``illum`` asks for reflections. ``illum`` 6 and 7 with an index Ni and hardly any Kd is glass.
What Blender has written is read by the formulas of its exporter.
"""

import os
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from fragtracer.errors import SceneError
from fragtracer.io.model import decoded, read_file
from fragtracer.io.model_images import ModelImages
from fragtracer.scene import Image, Material, Texture
from fragtracer.scene.reflectance import reflectance_from_ior
from fragtracer.scene.texture import ColorSpace

# The largest number of values of an option of a map.
_OPTIONS = {"-o": 3, "-s": 3, "-t": 3, "-mm": 2, "-bm": 1, "-boost": 1, "-texres": 1, "-clamp": 1, "-blendu": 1}
_OPTIONS |= {"-blendv": 1, "-imfchan": 1, "-type": 1, "-cc": 1}
_UNSUPPORTED = ("map_ks", "map_ns", "map_refl", "refl", "disp", "map_disp", "decal", "map_ps", "map_rma", "map_orm")
_UNSUPPORTED_NUMBERS = ("aniso",)
_MATTE, _MIRRORS, _REFRACTS = ("0", "1"), ("3", "5", "8"), ("6", "7")  # of illum
_SHEEN_ROUGHNESS = 0.5  # of Ps: the default of that of Blender
_LEAST_ALBEDO = 0.1  # of Kd: what has less, and refracts, is glass


def read_materials(obj: Path, libraries: Iterable[str]) -> tuple[dict[str, Material], list[Path], list[str]]:
    """Read the .mtl files that an .obj file names.

    Returns
    -------
    materials : dict
        By their names.
    files : list
        The libraries and images, also those that are missing.
    notes : list
        What is missing or ignored.
    """
    materials: dict[str, Material] = {}
    images = ModelImages(obj.parent)
    files: list[Path] = []
    for library in _each(obj.parent, libraries):
        path = obj.parent / library.replace("\\", "/")
        files.append(path)
        try:
            text = decoded(path, read_file(path))
        except SceneError as error:
            images.notes.append(f"{library} ({str(error).rpartition(': ')[2]}; its materials are grey)")
            continue
        images.folder = path.parent
        is_of_blender = text.startswith("# Blender")
        for name, values in _tables(text).items():
            materials[name] = _material(_as_blender_reads(values) if is_of_blender else values, images)
    return materials, [*files, *images.files], images.notes


def _each(folder: Path, libraries: Iterable[str]) -> Iterator[str]:
    """The names of libraries: a line has one, perhaps with spaces, or several."""
    for line in libraries:
        yield from [line] if "\0" not in line and os.path.exists(folder / line) else line.split()


def _tables(text: str) -> dict[str, dict[str, str]]:
    tables: dict[str, dict[str, str]] = {}
    table: dict[str, str] = {}
    for line in text.splitlines():
        key, value = [*line.split(None, 1), "", ""][:2]
        if key == "newmtl":
            table = tables.setdefault(value.strip(), {})
        elif key and not key.startswith("#"):
            table[key.lower()] = value.strip()
    return tables


def _as_blender_reads(values: dict[str, str]) -> dict[str, str]:
    """With the roughness, specular level and metallic that Blender's exporter has made Ns, Ks and Ka of."""
    level = 2 * float(np.mean(_color(values, "ks", 0.5, 1.0)))
    roughness = 1 - (_number(values, "ns", 250.0, 1000.0) / 1000) ** 0.5
    metallic = float(np.mean(_color(values, "ka", 0.0, 1.0))) if values.get("illum") == "3" else 0.0
    found = {"specular": str(level)} | ({} if _has_pbr(values) else {"pr": str(roughness), "pm": str(metallic)})
    return values | found


def _material(values: dict[str, str], images: ModelImages) -> Material:
    images.notes += [f"{key} in .mtl" for key in _UNSUPPORTED if key in values]
    images.notes += [f"{key} in .mtl" for key in _UNSUPPORTED_NUMBERS if any(_color(values, key, 0.0, 1.0))]
    images.notes += [
        f"{key} in .mtl above 1 (taken as 1)" for key in ("kd", "ks") if max(_color(values, key, 0.0, 1e30)) > 1
    ]
    if _is_glass(values):
        filtered = _color(values, "tf", 1.0, 1.0)
        made: dict[str, Any] = {"model": "dielectric", "roughness": 0.0, "ior": _number(values, "ni", 1.0, 10.0)}
        return Material(**made, transmittance=filtered if any(filtered) else (1.0, 1.0, 1.0))
    made = {"albedo": _color(values, "kd", 1.0 if "map_kd" in values else 0.5, 1.0)}
    if "map_kd" in values:
        made["albedo_texture"] = _texture(values["map_kd"], "srgb", images)
    made |= _reflectance(values, made)
    if (coat := _number(values, "pc", 0.0, 1)) > 0:
        made |= {"coat": coat, "coat_roughness": _number(values, "pcr", 0.0, 1)}
    if (sheen := _number(values, "ps", 0.0, 1)) > 0:
        made |= {"sheen_color": (sheen, sheen, sheen), "sheen_roughness": _SHEEN_ROUGHNESS}
    emission = _color(values, "ke", 0.0, np.inf)
    if "map_ke" in values and (texture := _texture(values["map_ke"], "srgb", images)):
        made["emission_texture"], emission = texture, emission if any(emission) else (1.0, 1.0, 1.0)
    made["emission"] = emission
    for key, name in (("pr", "roughness"), ("pm", "metallic")):
        if f"map_{key}" in values and (texture := _texture(values[f"map_{key}"], "linear", images)):
            made |= {f"{name}_texture": texture, name: _number(values, key, 1.0, 1)}
    made |= _normal_map(values, images)
    made |= _alpha(values, made.get("albedo_texture"), images)
    return Material(**made)


def _has_pbr(values: dict[str, str]) -> bool:
    return not values.keys().isdisjoint(("pr", "pm", "map_pr", "map_pm"))


def _is_glass(values: dict[str, str]) -> bool:
    is_clear = max(_color(values, "kd", 0.0, 1.0)) <= _LEAST_ALBEDO and not values.keys() & {"map_kd", "map_d"}
    return is_clear and values.get("illum") in _REFRACTS and _number(values, "ni", 1.0, 10.0) > 1


def _reflectance(values: dict[str, str], base: dict[str, Any]) -> dict[str, Any]:
    """Roughness and specular reflectance over a base."""
    ior = _number(values, "ni", 1.0, 10.0)
    made: dict[str, Any] = {"ior": ior} if ior > 1 else {}
    if _has_pbr(values):
        made |= {"roughness": _number(values, "pr", 0.5, 1), "metallic": _number(values, "pm", 0.0, 1)}
        return made | {"specular": _number(values, "specular", 1.0, 1)}
    illum, color = values.get("illum"), _color(values, "ks", 0.0, 1.0)
    is_colored = max(color) - min(color) > 0.01
    is_metal = is_colored and not any(base["albedo"]) and illum not in _MATTE
    if any(color) and (is_metal or illum in _MIRRORS):
        made = {"f0": color}
    elif not any(color) or illum in _MATTE:
        made["specular"] = 0.0
    elif is_colored:
        f0 = reflectance_from_ior(Material(**made).index)
        made = {"specular": max(color), "f0": tuple(f0 * channel / max(color) for channel in color)}
    else:
        made["specular"] = float(np.mean(color))
    if "ns" not in values and illum in _MIRRORS:
        return made | {"roughness": 0.0}
    return made | {"roughness": float((2 / (_number(values, "ns", 0.0, 1e6) + 2)) ** 0.25)}


def _normal_map(values: dict[str, str], images: ModelImages) -> dict[str, Any]:
    """``norm``, or ``map_bump`` unless it is grey: then it is a height map, which is ignored."""
    line = values.get("norm") or values.get("map_bump") or values.get("bump")
    texture = _texture(line, "linear", images) if line else None
    if texture is None or line is None:
        return {}
    pixels = texture.image.pixels
    if pixels.shape[2] < 3 or (pixels[..., 0] == pixels[..., 2]).all():
        images.notes.append("map_bump in .mtl (a height map)")
        return {}
    scale = _options(line)[0].get("-bm", [])
    return {"normal_texture": texture, "normal_scale": _float(scale[0], 1.0) if scale and "norm" not in values else 1.0}


def _alpha(values: dict[str, str], albedo: Texture | None, images: ModelImages) -> dict[str, Any]:
    opacity = _number(values, "d", 1.0, 1) if "d" in values else 1 - _number(values, "tr", 0.0, 1)
    made: dict[str, Any] = {"opacity": opacity, "alpha_mode": "blend"} if opacity < 1 else {}
    mask = _texture(values["map_d"], "linear", images) if "map_d" in values else None
    if mask is None:
        return made
    merged = _with_alpha(albedo, mask)
    if merged is None:
        images.notes.append("map_d in .mtl (of another size or kind than map_Kd)")
        return made
    return made | {"albedo_texture": merged, "alpha_mode": "blend"}


def _with_alpha(albedo: Texture | None, mask: Texture) -> Texture | None:
    """The albedo texture with the mask as its alpha; None if they do not fit."""
    if albedo is not None and albedo.image.file == mask.image.file and mask.image.pixels.shape[2] in (2, 4):
        return albedo
    alpha = mask.image.pixels[..., -1 if mask.image.pixels.shape[2] in (2, 4) else 0]
    alpha = alpha if alpha.dtype == np.uint8 else np.rint(255 * np.clip(alpha, 0, 1)).astype(np.uint8)
    if albedo is None:
        albedo = mask
        colors = np.full((*alpha.shape, 3), 255, np.uint8)
    else:
        pixels = albedo.image.pixels
        colors = np.broadcast_to(pixels[..., :3] if pixels.shape[2] > 2 else pixels[..., :1], (*pixels.shape[:2], 3))
    if colors.shape[:2] != alpha.shape or colors.dtype != np.uint8:
        return None
    image = Image(np.dstack([colors, alpha]), "srgb")
    return Texture(image, albedo.wrap_u, albedo.wrap_v, albedo.filter, albedo.offset, scale=albedo.scale)


def _texture(line: str, color_space: ColorSpace, images: ModelImages) -> Texture | None:
    options, file = _options(line)
    image = images.get(file.replace("\\", "/"), color_space)
    if image is None:
        return None
    scale = [_float(word, 1.0) for word in options.get("-s", [])] + [1.0, 1.0]
    offset = [_float(word, 0.0) for word in options.get("-o", [])] + [0.0, 0.0]
    wrap = "clamp" if options.get("-clamp") == ["on"] else "repeat"
    channel = (options.get("-imfchan") or ["r"])[0]
    # v is 0 at the lower edge in the file, at the upper edge here: 1 - (s (1 - v) + o) = s v + (1 - s - o).
    placed = {"scale": (scale[0], scale[1]), "offset": (offset[0], 1 - scale[1] - offset[1])}
    return Texture(image, wrap, wrap, channel=channel if channel in ("r", "g", "b") else "r", **placed)  # type: ignore[arg-type]


def _options(line: str) -> tuple[dict[str, list[str]], str]:
    """The options of a map, and its file name, perhaps with spaces."""
    options: dict[str, list[str]] = {}
    words = line.split()
    while len(words) > 1 and words[0] in _OPTIONS:
        option, *words = words
        numeric = option in ("-o", "-s", "-t", "-mm")
        count = 1 if not numeric else 0
        while numeric and count < _OPTIONS[option] and count + 1 < len(words) and _is_number(words[count]):
            count += 1
        options[option], words = words[:count], words[count:]
    return options, " ".join(words)


def _is_number(word: str) -> bool:
    return bool(np.isfinite(_float(word, np.nan)))


def _float(word: str, otherwise: float) -> float:
    try:
        value = float(word)
    except ValueError:
        return otherwise
    return value if abs(value) <= 1e30 else otherwise


def _before_comment(values: dict[str, str], key: str) -> list[str]:
    return values.get(key, "").partition("#")[0].split()


def _number(values: dict[str, str], key: str, otherwise: float, most: float) -> float:
    words = _before_comment(values, key)
    return min(max(_float(words[-1], otherwise), 0.0), most) if words else otherwise


def _color(values: dict[str, str], key: str, otherwise: float, most: float) -> tuple[float, float, float]:
    """An RGB colour or a grey; anything else, as a spectrum, is ignored."""
    words = _before_comment(values, key)[:3]
    numbers = [min(max(float(word), 0.0), most) for word in words if _is_number(word)]
    if len(numbers) < len(words) or len(numbers) not in (1, 3):
        return (otherwise,) * 3
    red, green, blue = numbers if len(numbers) == 3 else numbers * 3
    return (red, green, blue)
