# SPDX-License-Identifier: MIT
"""Whatever changes the noise alone leaves the picture as it is: estimators, samplers, filters, roulette."""

from functools import cache
from itertools import combinations, pairwise, product

import numpy as np
import pytest
from agreement import assert_agree, critical
from rendering import Image, Planter, batches, rendered
from scene_builders import lambert, rectangle, stare
from scipy import special

from fragtracer.io.toml import load
from fragtracer.renderer import Renderer
from fragtracer.scene import Camera, Light, Plane, Scene

SIZE = (48, 32)
# A bias of the whole picture that none of these tests could overlook, with the samples below ...
RESOLUTION = 0.01
# ... and where a few pixels have most of the noise: lights met by chance; glossy edges under ambient
# light that is sampled without regard to the gloss; the edge of the lamp where it is not stratified.
COARSE_RESOLUTION = 0.04

SETTINGS = {
    "nee": {"estimator": "nee"},
    "nee with 8 light samples": {"estimator": "nee", "light_samples": 8},
    "bsdf": {"estimator": "bsdf"},
    "mis with 8 light samples": {"estimator": "mis", "light_samples": 8},
    "hash sampler": {"sampler": "hash"},
    "no roulette": {"russian_roulette": False},
    "roulette from the first vertex": {"russian_roulette_depth": 1},
    "adaptive sampling": {"adaptive": "on"},
}


@pytest.fixture
def reference(ctx):
    """The bundled scene of that name by multiple importance sampling, rendered once."""
    return lambda name: _reference(ctx, name)


@cache
def _reference(ctx, name: str) -> Image:
    return batches(ctx, load(name), 256, range(4), size=SIZE)


@pytest.mark.parametrize(
    ("name", "changed"),
    [
        *product(["three-spheres-ambient"], ("nee", "bsdf", "adaptive sampling")),
        *product(["cornell-box"], (changed for changed in SETTINGS if changed not in ("nee", "adaptive sampling"))),
    ],
)
def test_settings_that_change_the_noise_alone(ctx, reference, name, changed):
    settings = SETTINGS[changed]
    coarse = settings.get("estimator") == "bsdf" or settings == {"sampler": "hash"}
    coarse |= name == "three-spheres-ambient" and settings.get("estimator") == "nee"
    images = batches(ctx, load(name), samples(settings), range(10, 14), size=SIZE, **settings)
    assert_agree(images, reference(name), COARSE_RESOLUTION if coarse else RESOLUTION)


def samples(settings: dict) -> int:
    """Samples per pixel: more, where lights are merely met by chance or samples not stratified; three whole stages."""
    if settings.get("estimator") == "bsdf":
        return 2048
    return 512 if settings.get("sampler") == "hash" or "adaptive" in settings else 256


FILTERS = ("box", "tent", "gaussian")


@pytest.mark.parametrize("pixel_filter", FILTERS[1:])
def test_filters_agree_where_the_picture_is_smooth(ctx, pixel_filter):
    """On a floor under a large light, seen so near that its brightness is linear over some pixels."""
    light = Light((0.0, 2.0, 0.0), 1.0, power=100.0)
    scene = Scene(
        Camera((0.5, 1.0, 1.0), (0.5, 0.0, 0.0), fov_degrees=15.0),
        {"floor": lambert(0.5)},
        planes=[Plane((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), "floor")],
        lights=[light],
    )
    box, other = (batches(ctx, scene, 256, range(4), size=SIZE, pixel_filter=f) for f in ("box", pixel_filter))
    assert_agree(other, box, 0.0005)


@pytest.mark.parametrize("sampler", ["texture", "hash"])
@pytest.mark.parametrize("pixel_filter", FILTERS)
def test_filter_has_its_shape(ctx, pixel_filter, sampler):
    """Across the edge of a lamp pixels take the values of the filter's cumulative distribution."""
    cumulative = {
        "box": lambda x: np.clip(x + 0.5, 0, 1),
        "tent": lambda x: np.where(x < 0, np.clip(1 + x, 0, 1) ** 2 / 2, 1 - np.clip(1 - x, 0, 1) ** 2 / 2),
        "gaussian": lambda x: special.ndtr(x / 0.5),
    }[pixel_filter]
    width, height = 16, 64
    view = Camera((0.0, 0.0, 1.0), (0.0, 0.0, 0.0), fov_degrees=float(np.degrees(2 * np.arctan(height / 2))))
    # One pixel is one metre here; the lamp ends at x = 0.3, and in the picture at 8.3 from the left.
    lamp = rectangle((0.3 - 500.0, 0.0, 0.0), (1000.0, 0.0, 0.0), (0.0, 1000.0, 0.0), "lamp")
    scene = Scene(view, {"lamp": lambert(0.0, 1.0)}, rectangles=[lamp])
    spp = 4096
    columns = rendered(ctx, scene, spp, (width, height), pixel_filter=pixel_filter, sampler=sampler, bounces=0)[..., 0]
    expected = cumulative(8.3 - (np.arange(width) + 0.5))
    error = np.sqrt(expected * (1 - expected) / (spp * height))  # of a hash; the texture does better
    tolerance = critical(width, np.inf) * error + 1e-6
    assert tolerance.max() < 0.006
    assert (np.abs(columns.mean(0, np.float64) - expected) <= tolerance).all()


@pytest.mark.parametrize("name", ["three-spheres-ambient", "cornell-box"])
def test_each_bounce_only_adds_light(ctx, name):
    """With the same random numbers a path is the beginning of its longer self, so this holds for every
    pixel, up to rounding, and not for the mean alone."""
    scene = load(name)
    images = []
    settings = {"rays": 64, "guiding": "off", "adaptive": "off", "specialised": False}  # one program for all
    with Renderer(scene, (24, 16), context=ctx, **settings) as renderer:
        for bounces in range(21):
            renderer.reset(bounces=bounces)
            renderer.sample(64)
            assert renderer.non_finite_samples() == 0
            images.append(renderer.image().astype(np.float64))
    for fewer, more in pairwise(images):
        assert (more >= fewer * (1 - 1e-5)).all()
    means = np.array([image.mean() for image in images])
    gains = np.diff(means)
    assert (gains[:5] > 1e-4 * means[-1]).all()
    assert gains[-1] < 1e-3 * means[-1]


@pytest.mark.parametrize("estimator", ["nee", "bsdf", "mis"])
def test_no_bounces_show_emission_alone(ctx, estimator):
    image = rendered(ctx, load("cornell-box"), 64, SIZE, bounces=0, estimator=estimator)
    lamp = np.float32([17, 12, 4])
    seen = image.any(-1)
    assert 3 < seen.sum() < 30
    share = image[seen] / lamp
    assert np.ptp(share, axis=-1).max() < 1e-5
    assert share.max() <= 1 + 1e-6
    sky = load("three-spheres-ambient")
    image = rendered(ctx, sky, 64, SIZE, bounces=0, estimator=estimator)
    assert (image[0] == np.float32(sky.ambient.radiance)).all()  # the sky above
    assert not image[-1].any()  # the floor below


def test_geometry_terms_differ_a_little(ctx):
    scene = load("roughness-grid")
    terms = ("smith", "smith-height-correlated", "schlick-beckmann", "karis")
    images = [rendered(ctx, scene, 64, SIZE, geometry=geometry) for geometry in terms]
    for one, other in combinations(images, 2):
        assert 0.7 < one.mean() / other.mean() < 1.4
        assert np.abs(one - other).mean() > 0.001 * other.mean()


def test_more_light_samples_mean_less_noise(ctx):
    """Eight samples of the light are independent: an eighth of the variance, at a point that sees half of it."""
    shade = rectangle((1.0, 2.0, 0.0), (2.0, 0.0, 0.0), (0.0, 0.0, 6.0), "floor")
    scene = Scene(
        stare((0.0, 0.0, 0.0), (0.0, 1.0, 6.0)),
        {"floor": lambert(0.5)},
        planes=[Plane((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), "floor")],
        rectangles=[shade],
        lights=[Light((0.0, 4.0, 0.0), 1.0, power=100.0)],
    )
    variances = []
    for light_samples in (1, 8):
        settings = {"estimator": "nee", "sampler": "hash", "bounces": 1, "rays": 128, "light_samples": light_samples}
        with Renderer(scene, (256, 256), context=ctx, adaptive="off", gradient_domain="off", **settings) as renderer:
            renderer.sample(128)
            variances.append(np.square(renderer.standard_error(), dtype=np.float64).mean())
    # From 65,536 half-differences, the variance is known to 0.6 %, the ratio to 0.8 %.
    assert variances[0] / variances[1] == pytest.approx(8, rel=0.03)


def _compare(ctx, name: str, changed: dict, unchanged: dict) -> None:
    images = [batches(ctx, load(name), samples(s), range(4), size=SIZE, **s) for s in (changed, unchanged)]
    assert_agree(*images, COARSE_RESOLUTION)


# Errors that the comparisons above must find: file, text, what stands there instead, and two settings
# that should agree.
PLANTED = {
    "density of the diffuse lobe 3 % too high": (
        *("bsdf/cook_torrance.glsl", "square_to_cosine_hemisphere_pdf(wi));"),
        "1.03 * square_to_cosine_hemisphere_pdf(wi));",
        *("three-spheres", {"estimator": "bsdf"}, {"estimator": "nee"}),
    ),
    "the same random numbers in every dimension": (
        *("sampler/texture.glsl", "uint(dimension), block)", "0u, block)", "cornell-box", {}, {"sampler": "hash"}),
    ),
}


@pytest.mark.parametrize(("file", "text", "replacement", "name", "changed", "unchanged"), PLANTED.values(), ids=PLANTED)
def test_planted_error_is_found(ctx, monkeypatch, tmp_path, file, text, replacement, name, changed, unchanged):
    _compare(ctx, name, changed, unchanged)
    Planter(monkeypatch, tmp_path)(file, text, replacement)
    with pytest.raises(AssertionError, match="regions differ"):
        _compare(ctx, name, changed, unchanged)
