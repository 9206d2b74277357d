# SPDX-License-Identifier: MIT
"""What is written down of a comparison: the page, the numbers, the words and the picture."""

import json
import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from fragtracer.apps.bench.error import Reference
from fragtracer.apps.compare import pictures, to_json, words, write_report, write_side_by_side
from fragtracer.apps.compare.report import render_report
from fragtracer.apps.compare.run import compare_renderings
from fragtracer.errors import FragtracerError, OutputError

from .conftest import HEIGHT, WIDTH

VOID = {"meta", "img", "link", "br"}


class Page(HTMLParser):
    """Checks that elements nest, and collects what they refer to."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.references: list[str] = []
        self.tags: list[str] = []
        self.feed(text)
        self.close()
        assert not self.open

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        self.references += [value for name, value in attrs if name in ("src", "href", "xlink:href", "srcset", "data")]
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.tags.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


@pytest.mark.parametrize("factor", [1.0, 1.02])
def test_page_is_well_formed_and_needs_nothing_else(compared, factor):
    text = render_report(compared(factor))
    page = Page(text)
    assert page.tags.count("img") == 6
    assert all(reference.startswith(("data:image/png;base64,", "#")) for reference in page.references)
    assert not {"script", "iframe", "object", "link"} & set(page.tags)
    bare = re.sub(r"data:image/png;base64,[A-Za-z0-9+/=]+", "", text)
    assert not re.search(r"https?://|file:|@import|url\((?!#)", bare)
    assert not re.search(r"(?<![\w<])/(?:\w+/)+\w+", bare), "a path of this machine"


def test_page_has_the_verdict_and_the_numbers(compared):
    comparison = compared()
    text = render_report(comparison)
    assert "fragtracer and Mitsuba agree on test &lt;scene&gt;." in text
    bias = words.percent(float(np.max(comparison.verdict.detectable_bias)))
    assert text.count(bias) >= 2
    for expected in ("equal within ±1 %", "a device", "a variant", "2.0 s", "3.0 s", "4, 4", f"{WIDTH}"):
        assert expected in text
    assert "48 of 48" in text
    assert text.count(words.percent(comparison.verdict.block_biases[0])) >= 2
    assert "disagree on" in render_report(compared(1.02))
    assert "use --spp" in render_report(compared(deviation=2.0))


def test_page_says_what_mitsuba_rendered(compared):
    comparison = replace(compared(), measures=replace(compared().measures, ours_relative_mse=0.1))
    own = replace(comparison, file=Path("house") / "room.xml")
    ours = "an integrator and emitters of ours"
    assert ours in render_report(comparison)
    assert ours not in render_report(own)
    assert "Mitsuba rendered room.xml itself" in render_report(own)
    assert (to_json(comparison)["mitsuba_file"], to_json(own)["mitsuba_file"]) == (None, "room.xml")


def test_page_of_black_pictures(compared):
    assert "disagree on" in render_report(compared(0.0, 0.0))
    ours, reference = (replace(each, pictures=0 * each.pictures) for each in (compared().ours, compared().reference))
    comparison = compare_renderings(compared().scene, ours, reference)
    assert "Mitsuba agree on" in render_report(comparison)
    none, both = words.reasons(comparison)
    assert none.startswith("None of ")
    assert both == "Both pictures are black."
    only_theirs = compare_renderings(compared().scene, compared().ours, reference)
    assert "the clearest is +∞ %" in words.summary(only_theirs)


def test_report_file(compared, tmp_path):
    write_report(tmp_path / "report.html", compared())
    assert Page((tmp_path / "report.html").read_text("utf-8")).tags[0] == "html"
    with pytest.raises(OutputError, match="html"):
        write_report(tmp_path / "report.pdf", compared())


@pytest.mark.parametrize("package", ["jinja2", "matplotlib"])
def test_without_a_package_the_error_says_what_to_install(compared, monkeypatch, package):
    monkeypatch.setitem(__import__("sys").modules, package, None)
    with pytest.raises(FragtracerError, match=r"fragtracer\[reference\]"):
        render_report(compared())


@pytest.mark.parametrize("factor", [1.0, 1.02, 0.0])
def test_json_is_strict_and_comes_back(compared, factor):
    comparison = compared(factor)
    numbers = to_json(comparison)
    again = json.loads(json.dumps(numbers, allow_nan=False))
    assert again == numbers
    assert again["verdict"]["exit_status"] == comparison.exit_status
    assert np.shape(again["blocks"]["z"]) == comparison.verdict.blocks.z.shape
    assert again["image"]["ours"][0][0] == comparison.verdict.image.pair.ours[0, 0].tolist()
    assert again["settings"]["width"] == WIDTH
    assert again["verdict"]["regions_judged"] == again["verdict"]["regions_lit"] == 48
    assert np.shape(again["blocks"]["detectable_bias"]) == comparison.verdict.blocks.z.shape
    assert again["settings"]["bounces"] == comparison.scene.render.bounces
    off = ("guiding", "gradient_domain", "adaptive", "light_tracing")
    assert [again["settings"][name] for name in off] == ["off"] * 4


def test_measures_describe_the_noise(compared):
    same, other = compared().measures, compared(1.1).measures
    assert same.relative_mse == pytest.approx(same.expected_relative_mse, rel=0.05)
    assert other.relative_mse > 25 * other.expected_relative_mse
    assert 0 <= same.flip < other.flip < 1
    assert same.efficiency_ratio == pytest.approx(1.5, rel=0.1)
    assert same.efficiencies[0] == pytest.approx(1 / (2.0 * same.ours_relative_mse))


def test_relative_mse_is_that_of_the_benchmark(compared):
    """The scatter between batches estimates the error against the true image."""
    comparison = compared()
    truth = np.broadcast_to(np.linspace(0.2, 1.0, WIDTH)[:, None] * np.array([1.0, 0.8, 0.5]), (HEIGHT, WIDTH, 3))
    for rendering, found in (
        (comparison.ours, comparison.measures.ours_relative_mse),
        (comparison.reference, comparison.measures.reference_relative_mse),
    ):
        assert found == pytest.approx(Reference(truth, truth).relative_mse(rendering.picture), rel=0.05)


def test_without_flip_the_page_does(compared, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "flip_evaluator", None)
    comparison = compared()
    assert comparison.measures.flip is None
    assert "—" in render_report(comparison)


def test_words_say_what_was_left_off_and_what_few_batches_tell(compared):
    comparison = compared()
    text = words.summary(comparison)
    assert "leaves off" not in text
    render = replace(comparison.scene.render, guiding="on", gradient_domain="on")
    asked = replace(comparison, scene=replace(comparison.scene, render=render))
    assert "asks for guiding and gradient domain, which compare leaves off." in words.summary(asked)
    few = replace(comparison, ours=replace(comparison.ours, pictures=comparison.ours.pictures[:8]))
    is_told = ["batches these probabilities are lower" in words.summary(each) for each in (comparison, few)]
    assert is_told == [comparison.batches < 16, True]


def test_words_name_the_place(compared):
    text = words.summary(compared(1.02))
    assert "disagree on test <scene>" in text
    assert "in the picture as a whole" in text
    assert "3 samples of fragtracer were NaN" in words.summary(compared(non_finite=3))
    comparison = compared()
    assert words.place(comparison, comparison.verdict.regions, 0, 3) == "at pixels x = 36 to 47, y = 0 to 8"


@pytest.mark.parametrize(
    ("share", "text"), [(0.01234, "1.2 %"), (0.00001234, "0.0012 %"), (0, "0 %"), (-1.5, "−150 %"), (1e-9, "0.0000 %")]
)
def test_percentages(share, text):
    assert words.percent(share) == text


def test_side_by_side_picture(compared, tmp_path):
    write_side_by_side(tmp_path / "pair.png", compared())
    with Image.open(tmp_path / "pair.png") as image:
        assert image.mode == "RGBA"
        assert image.width > 3 * WIDTH
        assert image.height > HEIGHT
        assert image.getpixel((WIDTH + 1, 1))[3] == 0
    with pytest.raises(OutputError):
        write_side_by_side(tmp_path / "pair.jpg", compared())


def test_colours_of_differences():
    colours = pictures.diverging(np.array([-9.0, 0.0, 9.0]), 1.0)
    assert colours[0].tolist() == [0x21, 0x66, 0xAC]
    assert colours[1].tolist() == [0xF7, 0xF7, 0xF7]
    assert colours[2].tolist() == [0xB2, 0x18, 0x2B]
    assert pictures.round_limit(np.linspace(-0.034, 0.034, 999)) == pytest.approx(0.05)


def test_enlarged_parts_cover_the_pixels_they_were_measured_on():
    parts = np.arange(36, dtype=np.uint8).reshape(3, 4, 3)
    large = pictures.enlarged(parts, (10, 7))
    assert large.shape == (7, 10, 3)
    assert (large[:2, :2] == parts[0, 0]).all()
    assert (large[4:, 7:] == parts[2, 3]).all()
