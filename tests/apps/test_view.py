# SPDX-License-Identifier: MIT
"""Where things are in the picture: the camera, its angle, its lens, and which way is up."""

import numpy as np
import pytest
from rendering import Image, rendered
from scene_builders import lambert

from fragtracer.scene import Camera, Scene, Sphere


def ball_at(center, **camera) -> Scene:
    view = {"position": (0.0, 0.0, 10.0), "target": (0.0, 0.0, 0.0), "fov_degrees": 40.0} | camera
    return Scene(Camera(**view), {"lamp": lambert(0.0, 1.0)}, spheres=[Sphere(center, 0.5, "lamp")])


def spot(image: Image) -> tuple[float, float]:
    """Centre of the bright pixels, in pixels from the left and the top."""
    rows, columns = np.nonzero(image[..., 0] > 0.5)
    return float(columns.mean() + 0.5), float(rows.mean() + 0.5)


@pytest.mark.parametrize(
    ("center", "column", "row"),
    [((2.0, 0.0, 0.0), 1, 0), ((-2.0, 0.0, 0.0), -1, 0), ((0.0, 2.0, 0.0), 0, 1), ((0.0, -2.0, 0.0), 0, -1)],
)
def test_right_is_right_and_up_is_up(ctx, center, column, row):
    """For a camera along -z, x runs to the right; y runs up, to row 0."""
    width, height = 96, 64
    across, down = spot(rendered(ctx, ball_at(center), 16, (width, height), bounces=0))
    pixels = 2 / 10 / np.tan(np.radians(20)) * height / 2  # two metres in ten; the angle is vertical
    assert across == pytest.approx(width / 2 + column * pixels, abs=0.5)
    assert down == pytest.approx(height / 2 - row * pixels, abs=0.5)


@pytest.mark.parametrize("size", [(64, 64), (128, 64), (32, 64), (65, 63)])
def test_shape_of_the_picture(ctx, size):
    """The vertical angle stays, whatever the width; a ball is round; an image is rows of columns."""
    image = rendered(ctx, ball_at((0.0, 0.0, 0.0)), 64, size, bounces=0)
    assert image.shape == (size[1], size[0], 3)
    rows, columns = (np.ptp(axis) + 1 for axis in np.nonzero(image[..., 0] > 0.5))
    radius = np.tan(np.arcsin(0.5 / 10)) / np.tan(np.radians(20)) * size[1] / 2
    assert rows == pytest.approx(2 * radius, abs=1.1)
    assert columns == pytest.approx(2 * radius, abs=1.1)
    area = image[..., 0].sum(dtype=np.float64)
    assert area == pytest.approx(np.pi * radius**2, rel=0.01)


def test_camera_may_look_from_anywhere(ctx):
    """From the side, from above and rolled: what is up for the camera is at the top."""
    for position, up, center in (
        ((10.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, -2.0)),  # right of a camera that looks along -x
        ((0.0, 10.0, 0.0), (0.0, 0.0, -1.0), (2.0, 0.0, 0.0)),
        ((0.0, 0.0, 10.0), (1.0, 0.0, 0.0), (0.0, -2.0, 0.0)),
    ):
        image = rendered(ctx, ball_at(center, position=position, up=up), 16, (64, 64), bounces=0)
        across, down = spot(image)
        assert across == pytest.approx(32 + 2 / 10 / np.tan(np.radians(20)) * 32, abs=0.6)
        assert down == pytest.approx(32, abs=0.6)


def test_lens_blurs_what_is_out_of_focus(ctx):
    """A far point of light shows the lens; in the plane of focus it shows itself."""
    sharp, focused = (
        rendered(ctx, ball_at((0.0, 0.0, 0.0), aperture_radius=a), 256, (64, 64), bounces=0) for a in (0.0, 0.4)
    )
    assert np.abs(sharp - focused).mean() < 0.1 * sharp.mean()
    blurred = rendered(ctx, ball_at((0.0, 0.0, 0.0), aperture_radius=0.4, focus_distance=5.0), 256, (64, 64), bounces=0)
    radius = np.tan(np.arcsin(0.5 / 10)) / np.tan(np.radians(20)) * 32
    # The circle of confusion has the radius of the lens, 0.4 m, at twice the distance of the plane of focus.
    blurred_radius = radius * (1 + 0.4 / 0.5)
    rows, _ = np.nonzero(blurred[..., 0] > 0)
    assert np.ptp(rows) + 1 == pytest.approx(2 * blurred_radius, abs=2.1)
    assert blurred.sum() == pytest.approx(sharp.sum(), rel=0.03)
