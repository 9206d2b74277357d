# SPDX-License-Identifier: MIT
"""core/math.glsl and core/frame.glsl."""

import moderngl
import numpy as np
import pytest

from fragtracer.probe import probe

from .chi_square import assert_uniform

BELOW_ONE = np.nextafter(np.float32(1), np.float32(0))


def test_cos_sin_turns(ctx: moderngl.Context) -> None:
    turns = np.append(np.linspace(0, 1, 1 << 20), [0.25, 0.5, 0.75, BELOW_ONE, 1e-30]).astype(np.float32)
    result = probe(ctx, ["core/math.glsl"], "cos_sin = cos_sin_turns(turns);", {"turns": turns}, {"cos_sin": 2})[
        "cos_sin"
    ]
    angle = 2 * np.pi * turns.astype(np.float64)
    np.testing.assert_allclose(result, np.stack([np.cos(angle), np.sin(angle)], -1), rtol=0, atol=3e-7)


def test_turns_of(ctx: moderngl.Context) -> None:
    angle = np.linspace(-np.pi, np.pi, 1 << 16)[1:-1]
    v = (10 ** np.linspace(-15, 15, len(angle)) * np.stack([np.cos(angle), np.sin(angle)])).T.astype(np.float32)
    result = probe(ctx, ["core/math.glsl"], "turns = turns_of(v);", {"v": v}, {"turns": 1})["turns"]
    x, y = v.T.astype(np.float64)
    np.testing.assert_allclose(result, np.arctan2(y, x) / (2 * np.pi), rtol=0, atol=5e-8)


@pytest.mark.parametrize("probability", [1e-6, 0.01, 1 / 3, 0.5, 0.999, 1 - 1e-6])
def test_choose_first_stretches_what_is_left(ctx: moderngl.Context, probability: float) -> None:
    """Whichever alternative is taken, the number is uniform again: over all u, and within each."""
    u = np.random.default_rng(1).random(1 << 21, np.float32)
    body = "stretched = u; first = float(choose_first(probability, stretched));"
    inputs = {"u": u, "probability": np.full(len(u), probability)}
    result = probe(ctx, ["core/math.glsl"], body, inputs, {"first": 1, "stretched": 1})
    first = result["first"] > 0
    np.testing.assert_array_equal(first, u < np.float32(probability))
    assert_uniform({"all": result["stretched"]})
    stretched = {"first": result["stretched"][first], "second": result["stretched"][~first]}
    assert_uniform({name: values for name, values in stretched.items() if len(values) > 10_000})


def test_choose_first_at_the_ends(ctx: moderngl.Context) -> None:
    """Probability 0 and 1 leave u alone, and no u leaves [0, 1)."""
    tiny = np.finfo(np.float32).tiny
    ends = [0, tiny, 1e-20, 2**-24, 0.5, BELOW_ONE]
    cases = np.array([(p, u) for p in [*ends, 1] for u in [*ends, np.nextafter(np.float32(0.5), np.float32(0))]])
    body = "stretched = u; first = float(choose_first(probability, stretched));"
    result = probe(
        ctx, ["core/math.glsl"], body, {"probability": cases[:, 0], "u": cases[:, 1]}, {"first": 1, "stretched": 1}
    )
    assert (result["stretched"] >= 0).all()
    assert (result["stretched"] < 1).all()
    for probability in (0, 1):
        there = cases[:, 0] == probability
        assert (result["first"][there] == probability).all()
        np.testing.assert_array_equal(result["stretched"][there], cases[there, 1].astype(np.float32))


def test_power_heuristic(ctx: moderngl.Context) -> None:
    rng = np.random.default_rng(2)
    pdf, other = 10 ** rng.uniform(-15, 15, (2, 1 << 12))
    pdf[:3], other[:4] = 0, (1, 0, np.inf, np.inf)
    weights = {"weight": 1, "against": 1}
    body = "weight = power_heuristic(pdf, other); against = power_heuristic(other, pdf);"
    result = probe(ctx, ["core/math.glsl"], body, {"pdf": pdf, "other": other}, weights)
    assert result["weight"][:4].tolist() == [0, 0, 0, 0]
    a, b = pdf[4:], other[4:]
    np.testing.assert_allclose(result["weight"][4:], 1 / (1 + (b / a) ** 2), rtol=1e-5, atol=1e-37)
    np.testing.assert_allclose(result["weight"][4:] + result["against"][4:], 1, rtol=1e-6)


def test_luminance_and_max_component(ctx: moderngl.Context) -> None:
    color = np.random.default_rng(3).random((1 << 10, 3)).astype(np.float32)
    body = "y = luminance(color); largest = max_component(color); s = square(color.x);"
    result = probe(ctx, ["core/math.glsl"], body, {"color": color}, {"y": 1, "largest": 1, "s": 1})
    np.testing.assert_allclose(result["y"], color @ [0.2126, 0.7152, 0.0722], rtol=1e-6)
    np.testing.assert_array_equal(result["largest"], color.max(1))
    np.testing.assert_allclose(result["s"], color[:, 0] ** 2, rtol=1e-6)


def test_is_finite(ctx: moderngl.Context) -> None:
    largest = np.finfo(np.float32).max
    values = np.array([0, -0.0, 1e-45, largest, -largest, np.inf, -np.inf, np.nan], np.float32)
    triple = np.ones((len(values), 3), np.float32)
    triple[np.arange(len(values)), np.arange(len(values)) % 3] = values
    body = "one = float(is_finite(x)); three = float(is_finite(v));"
    result = probe(ctx, ["core/math.glsl"], body, {"x": values, "v": triple}, {"one": 1, "three": 1})
    np.testing.assert_array_equal(result["one"], np.isfinite(values))
    np.testing.assert_array_equal(result["three"], np.isfinite(values))


def test_frame_is_orthonormal_and_right_handed(ctx: moderngl.Context) -> None:
    rng = np.random.default_rng(4)
    near_pole = [(0, 0, 1), (0, 0, -1), (1e-4, 0, -1), (0, -1e-7, -1), (1, 0, 0), (0, 1, -0.0), (1, 0, -1e-30)]
    normals = np.concatenate([near_pole, rng.normal(size=(1 << 12, 3))])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    vector = rng.normal(size=normals.shape)
    body = """
        Frame f = frame_from_normal(n);
        tangent = f.tangent; bitangent = f.bitangent; normal = f.normal;
        world = frame_to_world(f, v); back = frame_to_local(f, world);"""
    outputs = {"tangent": 3, "bitangent": 3, "normal": 3, "world": 3, "back": 3}
    result = probe(ctx, ["core/frame.glsl"], body, {"n": normals, "v": vector}, outputs)
    axes = np.stack([result[name] for name in ("tangent", "bitangent", "normal")], 1).astype(np.float64)
    np.testing.assert_allclose(axes @ axes.transpose(0, 2, 1), np.broadcast_to(np.eye(3), axes.shape), atol=5e-7)
    np.testing.assert_allclose(np.linalg.det(axes), 1, atol=1e-6)
    np.testing.assert_array_equal(result["normal"], normals.astype(np.float32))
    np.testing.assert_allclose(result["world"], np.einsum("nk,nkx->nx", vector, axes), atol=3e-6)
    np.testing.assert_allclose(result["back"], vector, atol=3e-6)
