# SPDX-License-Identifier: MIT
"""Verdicts on synthetic pictures: how often they are wrong, and what they find."""

import numpy as np
import pytest
from scipy import stats

from fragtracer.apps.compare.pictures import difference_caption
from fragtracer.apps.compare.verdict import ALPHA, judge

from .conftest import BATCHES, HEIGHT, WIDTH, noisy


def outcomes(make, runs: int, **options) -> list[str]:
    """Of ``runs`` judgements on pairs of stacks that ``make(rng)`` gives."""
    rng = np.random.default_rng(11)
    return [judge(*make(rng), **options).outcome for _ in range(runs)]


def at_most(count: int, runs: int, rate: float) -> bool:
    """Whether ``count`` of ``runs`` may come from ``rate`` or less, with an error once in 1000 tests."""
    return stats.binom.sf(count - 1, runs, rate) > 1e-3


def test_equal_renderers_disagree_as_rarely_as_stated():
    found = outcomes(lambda rng: (noisy(rng), noisy(rng)), 300)
    assert at_most(found.count("disagreement"), 300, ALPHA)
    assert found.count("agreement") > 290


def test_the_level_holds_with_fireflies():
    """Each part has light that comes in rare flashes, twice as rare and twice as bright in one renderer."""

    def make(rng):
        shape = (BATCHES, 9, 16, 3)  # of parts: a pixel stands for a block of them
        flashes = [0.3 * rng.poisson(rate, shape) / rate for rate in (0.5, 1.0)]
        return [0.7 + light + rng.normal(0, 0.003, shape) for light in flashes]

    found = outcomes(make, 300)
    assert at_most(found.count("disagreement"), 300, 2 * ALPHA)


@pytest.mark.parametrize("bias", [-0.01, 0.01])
def test_a_bias_of_a_percent_is_found(bias):
    found = outcomes(lambda rng: ((1 + bias) * noisy(rng), noisy(rng)), 40)
    assert found == ["disagreement"] * 40


def test_a_bias_in_one_place_is_found():
    rng = np.random.default_rng(3)
    ours = noisy(rng)
    ours[:, 20:24, 8:12, 1] *= 1.1
    verdict = judge(ours, noisy(rng))
    assert not verdict.image.differs.any()
    blocks = np.argwhere(verdict.blocks.differs)
    assert len(blocks) >= 1
    assert {tuple(place) for place in blocks.tolist()} <= {(r, c, 1) for r in (4, 5, 6, 7) for c in (2, 3, 4)}
    assert verdict.outcome == "disagreement"


def test_noise_larger_than_the_margin_is_inconclusive():
    found = outcomes(lambda rng: (noisy(rng, 2.0), noisy(rng, 2.0)), 100)
    assert "agreement" not in found
    assert found.count("inconclusive") > 95


def test_the_samples_asked_for_are_enough():
    rng = np.random.default_rng(5)
    verdict = judge(noisy(rng, 1.0), noisy(rng, 1.0))
    assert verdict.outcome == "inconclusive"
    assert verdict.spp_factor > 1
    deviation = 1.0 / verdict.spp_factor**0.5
    found = outcomes(lambda rng: (noisy(rng, deviation), noisy(rng, deviation)), 50)
    assert found.count("agreement") >= 44


def test_a_colour_that_one_renderer_hardly_has_asks_for_no_samples_without_end():
    rng = np.random.default_rng(7)
    ours, reference = noisy(rng, 1.0), noisy(rng, 1.0)
    ours[..., 2] = reference[..., 2] = 0.0
    ours[0, 0, 0, 2] = 0.01
    verdict = judge(ours, reference)
    assert verdict.outcome == "inconclusive"
    assert 1 < verdict.spp_factor < np.inf


def test_the_scale_of_a_small_difference_is_told():
    assert difference_caption(0.002) == "difference, blue -0.2 % to red +0.2 %"


def test_regions_that_are_too_noisy_do_not_decide():
    rng = np.random.default_rng(6)
    dark = np.ones((HEIGHT, WIDTH, 1))
    dark[: HEIGHT // 4] = 1e-4
    ours, reference = (noisy(rng) * dark + rng.normal(0, 1e-3, (BATCHES, HEIGHT, WIDTH, 3)) for _ in range(2))
    verdict = judge(ours, reference)
    assert not verdict.judged_regions[0].any()
    assert verdict.judged_regions[1:].all()
    assert verdict.outcome == "agreement"


def test_light_that_leaks_into_black_shadow_is_found():
    """However little it is of the image mean."""
    rng = np.random.default_rng(12)
    shadow = np.ones((HEIGHT, WIDTH, 1))
    shadow[8:20, 8:24] = 1e-5
    ours, reference = noisy(rng) * shadow, noisy(rng) * shadow
    ours[:, 12:16, 12:16] += 1e-6
    verdict = judge(ours, reference)
    assert not verdict.image.differs.any()
    assert verdict.blocks.differs[4, 4].all()
    ours[:, 12:16, 12:16] -= 1e-6
    assert judge(ours, reference).outcome == "agreement"


def test_regions_judged_and_the_biases_of_blocks():
    """Black regions are not counted, and dark ones in too much noise are not judged."""
    rng = np.random.default_rng(13)
    factor = np.ones((HEIGHT, WIDTH, 1))
    factor[: HEIGHT // 4] = 0
    noise = np.zeros((HEIGHT, WIDTH, 1))
    noise[-HEIGHT // 4 :] = 1
    ours, reference = (noisy(rng) * factor + noise * rng.normal(0, 1, (BATCHES, HEIGHT, WIDTH, 3)) for _ in range(2))
    verdict = judge(ours, reference)
    assert verdict.judged_share == (24, 36)
    median, worst = verdict.block_biases
    assert worst > 0.5 > 0.05 > median == np.median(verdict.blocks.detectable_bias[2:])
    assert judge(0 * ours, 0 * reference).judged_share == (0, 0)
    assert judge(0 * ours, 0 * reference).block_biases == (0, 0)


@pytest.mark.parametrize(("judged", "bias"), [(0.9, 1.0), (0.01, 0.004)])
def test_samples_for_judged_regions_and_for_the_median_block_are_enough(judged, bias):
    rng = np.random.default_rng(14)
    factor = judge(noisy(rng, 0.5), noisy(rng, 0.5)).spp_factor_for(judged, bias)
    assert factor > 1
    deviation = 0.5 / (1.05 * factor) ** 0.5
    found = [judge(noisy(rng, deviation), noisy(rng, deviation)) for _ in range(9)]
    enough = [v.judged_share[0] >= judged * v.judged_share[1] and v.block_biases[0] <= bias for v in found]
    assert sum(enough) >= 5
    assert judge(noisy(rng, 0.1 * deviation), noisy(rng, 0.1 * deviation)).spp_factor_for(judged, bias) < 0.1


def test_scores_of_noise_follow_the_normal_distribution():
    """Also where parts without noise, whose scores are those of rounding, are in the picture."""
    rng = np.random.default_rng(15)
    still = np.ones((HEIGHT, WIDTH, 1))
    still[: HEIGHT // 2] = 0
    scores = []
    for _ in range(20):
        ours, reference = (0.5 + 0.02 * still * rng.normal(size=(BATCHES, HEIGHT, WIDTH, 3)) for _ in range(2))
        scores.append(judge(ours * (1 + 1e-6 * (1 - still)), reference).blocks.noise_z)
    assert len(scores[0]) == judge(ours, reference).blocks.p.size / 2
    assert stats.kstest(np.concatenate(scores), "norm").pvalue > 1e-3


def test_pictures_without_noise():
    picture = np.broadcast_to(np.float32(0.5), (4, HEIGHT, WIDTH, 3)).copy()
    assert judge(picture, picture * np.float32(1 + 3e-6)).outcome == "agreement"
    assert judge(picture, picture * np.float32(1.001)).outcome == "disagreement"
    assert judge(0 * picture, 0 * picture).outcome == "agreement"


def test_a_tiny_picture_and_unequal_numbers_of_batches():
    rng = np.random.default_rng(8)
    verdict = judge(rng.normal(1, 0.01, (8, 2, 3, 3)), rng.normal(1, 0.01, (12, 2, 3, 3)))
    assert [scale.p.shape for scale in verdict.scales] == [(1, 1, 3), (2, 3, 3), (2, 3, 3)]
    assert verdict.comparisons == 39


def test_samples_that_are_not_finite_are_a_disagreement():
    rng = np.random.default_rng(9)
    verdict = judge(noisy(rng), noisy(rng), non_finite=1)
    assert (verdict.outcome, verdict.exit_status) == ("disagreement", 1)


@pytest.mark.parametrize(("deviation", "factor", "status"), [(0.02, 1.0, 0), (0.02, 1.02, 1), (2.0, 1.0, 2)])
def test_exit_status(deviation, factor, status):
    rng = np.random.default_rng(10)
    assert judge(factor * noisy(rng, deviation), noisy(rng, deviation)).exit_status == status


def test_what_cannot_be_judged_is_refused():
    good = np.ones((4, 8, 8, 3))
    for bad in (np.ones((4, 8, 9, 3)), np.ones((8, 8, 3)), np.full((4, 8, 8, 3), np.nan)):
        with pytest.raises(ValueError, match="pictures must be"):
            judge(good, bad)
    for options in ({"margin": 0.0}, {"margin": 1.0}, {"alpha": 0.5}):
        with pytest.raises(ValueError, match="must lie between"):
            judge(good, good, **options)
