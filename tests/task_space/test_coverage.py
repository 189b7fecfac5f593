"""What a shape leaves out of a thing that is seen from straight above, and how it fits points with noise along their rays."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.stats import norm

from hrcjax.task_space.coverage import MEDIAN, left_out
from hrcjax.task_space.instances import Part
from hrcjax.task_space.misfit import misfit
from hrcjax.task_space.shape_fit import FitParams
from hrcjax.task_space.solid_distance import solid_distances, solid_normals
from hrcjax.task_space.view import View, points
from hrcjax.world.scene import BOX, COLUMN, SPHERE

EDGE, FOCAL = 60, 200.0
PLACE = np.mgrid[20:40, 20:40].reshape(2, -1)
"""Rows and columns of a thing's pixels, which are 5 mm wide on the table."""


def seen(
    height: np.ndarray, deviation: float = 1e-6, tilt: float = 0.0, aside: float = 0.0
) -> tuple[list[View], list[Part], list[np.ndarray]]:
    """A camera 1 m over the origin whose image is tilted about x, and cut out so many pixels aside; the pixels of a thing of some height [m], and their points."""
    c, s = np.cos(tilt), np.sin(tilt)
    down = np.array([[1.0, 0, 0], [0, -c, -s], [0, s, -c]])
    position = np.array([0.0, 0, 1]) if tilt == 0 else -down[:, 2]
    view = View(
        down,
        position,
        np.full(2, FOCAL),
        np.array([EDGE / 2 - aside, EDGE / 2]),
        np.ones((EDGE, EDGE)),
        np.full((EDGE, EDGE), deviation),
    )
    ray = (points(view) - view.position)[..., 2]
    depth = np.zeros((EDGE, EDGE))
    depth[tuple(PLACE)] = (height - view.position[2]) / ray[tuple(PLACE)]
    view = view._replace(depth=depth)
    return [view], [Part(0, np.ravel_multi_index(tuple(PLACE), (EDGE, EDGE)), -1)], [points(view).reshape(-1, 3)]


def box(lower: float, upper: float):
    return BOX, np.array([0.0, 0, (lower + upper) / 2]), np.array([0.06, 0.06, (upper - lower) / 2]), 0.0


def out_of(height: np.ndarray, lower: float = 0.0, stands: bool = True, deviation: float = 1e-6) -> float:
    return left_out(*seen(height, deviation), box(lower, 0.05), stands, 12)


def test_a_top_that_is_higher_than_the_shape_is_left_out_and_a_lower_one_is_not() -> None:
    flat = np.full(PLACE.shape[1], 0.05)
    assert out_of(flat) == pytest.approx(0.0, abs=1e-5)
    assert out_of(flat + 0.013) == pytest.approx(0.013, abs=1e-5)
    assert out_of(flat - 0.013) == 0.0


def test_a_shape_that_hangs_over_the_table_leaves_out_what_is_below_a_thing_that_stands() -> None:
    flat = np.full(PLACE.shape[1], 0.05)
    assert out_of(flat, 0.03) == pytest.approx(0.03)
    assert out_of(flat, 0.03, stands=False) == pytest.approx(0.0, abs=1e-5)


def test_a_narrow_part_counts_and_pixels_that_fly_do_not() -> None:
    row = PLACE[0]
    higher = np.where((row >= 30) & (row < 33), 0.07, 0.02)  # three pixels wide, beside what lies deep within the shape
    assert out_of(higher) == pytest.approx(0.02, abs=1e-5)
    assert out_of(np.where(row == 20, 0.35, 0.05)) < 1e-5  # along the edge
    single = np.full(PLACE.shape[1], 0.05)
    single[[50, 51, 170, 333]] = 0.4
    assert out_of(single) < 1e-5


def test_a_part_of_fewer_pixels_than_a_thing_has_is_noise() -> None:
    """A thing of 3 x 3 pixels beside a shape: nothing is said of it, but of 3 x 4."""
    for wide, expected in ((3, 0.0), (4, 0.02)):
        views, parts, flat = seen(np.full(PLACE.shape[1], 0.07))
        rows, columns = np.mgrid[20:23, 20 : 20 + wide].reshape(2, -1)
        few = [parts[0]._replace(pixels=np.ravel_multi_index((rows, columns), (EDGE, EDGE)))]
        assert left_out(views, few, flat, box(0.0, 0.05), True, 12) == pytest.approx(expected, abs=1e-5)


@pytest.mark.parametrize("deviation", [0.0035, 0.014])
def test_noise_alone_is_not_left_out_and_more_than_it_is(deviation: float) -> None:
    """A centimetre is beyond the noise of 25 pixels, of 14 mm each, but for one in a hundred thousand; 2 deviations of their median
    over that is not left out."""
    draw = np.random.default_rng(0)
    noise = deviation * draw.normal(size=(20, PLACE.shape[1]))
    assert max(out_of(0.05 + one, deviation=deviation) for one in noise) < 0.01
    surely = 0.01 + 2 * 2.0 * MEDIAN * deviation / 5
    assert all(out_of(0.05 + surely + one, deviation=deviation) > 0.01 for one in noise)


def cauchy(shift: float) -> float:
    """Root mean Cauchy's loss of normal numbers of deviation 1 about a shift."""
    c = FitParams().robust
    return float(np.sqrt(quad(lambda z: norm.pdf(z, shift) * c**2 * np.log1p((z / c) ** 2), shift - 9, shift + 9)[0]))


@pytest.mark.parametrize(("tilt", "aside"), [(0.0, 0.0), (0.6, 0.0), (0.6, 150.0), (1.2, 0.0)])
@pytest.mark.parametrize("shift", [0.0, 2.0])
def test_misfit_is_that_of_normal_numbers_however_aslant_a_surface_is_seen(
    tilt: float, aside: float, shift: float
) -> None:
    """Noise along the depth makes less of it across a surface that is seen aslant; a surface off by 2 deviations fits as badly from anywhere."""
    deviation, solid = 0.004, (BOX, np.array([0.0, 0, -5.0]), np.array([50.0, 50, 5]), 0.0)
    views, parts, _ = seen(np.zeros(PLACE.shape[1]), deviation, tilt, aside)
    draw, pixels = np.random.default_rng(1), parts[0].pixels
    repeats = []
    for _ in range(40):
        depth = views[0].depth.copy()
        depth.flat[pixels] += deviation * (draw.normal(size=len(pixels)) + shift)
        noisy = views[0]._replace(depth=depth)
        repeats.append(misfit([noisy], parts, [points(noisy).reshape(-1, 3)], solid, FitParams(model=1e-9)))
    assert np.sqrt(np.mean(np.square(repeats))) == pytest.approx(cauchy(shift), rel=0.02)
    assert cauchy(0.0) < 1  # a thing of its shape is not tried as two


def test_normals_are_those_of_the_shapes() -> None:
    draw = np.random.default_rng(0)
    place = draw.normal(size=(50, 3)) * 0.1
    center = np.array([0.02, -0.01, 0.03])
    away = place - center
    np.testing.assert_allclose(solid_normals(SPHERE, center, np.full(3, 0.04), 0.0, place), away / np.linalg.norm(away, axis=1)[:, None], atol=1e-6)  # fmt: skip
    for kind in (SPHERE, COLUMN, BOX):
        shape = kind, center, np.array([0.04, 0.04 if kind == SPHERE else 0.03, 0.04]), 0.4
        far = solid_distances(*shape, place)
        n = solid_normals(*shape, place)
        outside = far > 1e-3
        np.testing.assert_allclose(np.linalg.norm(n[outside], axis=1), 1, atol=1e-4)
        np.testing.assert_allclose(solid_distances(*shape, (place - far[:, None] * n)[outside]), 0, atol=1e-6)
