"""Lenses against formulas written out here, and depth of planes that must come out flat."""

import numpy as np
import pytest
from scipy.optimize import brentq

from hrcjax.io.recordings.frame import Intrinsics
from hrcjax.io.recordings.lens import Lens, distorted, lens_of, without_distortion
from hrcjax.io.recordings.open_input import open_input
from hrcjax.lab.errors import UsageError

CAMERA = Intrinsics(260.0, 262.0, 158.0, 121.0, 320, 240)
RATIONAL = (0.8, -0.3, 0.002, -0.001, 0.05, 1.1, -0.1, 0.02)


def test_rational_model_in_the_words_of_its_authors() -> None:
    k1, k2, p1, p2, k3, k4, k5, k6 = RATIONAL
    for x, y in ((0.3, -0.2), (-0.4, 0.1), (0.0, 0.0)):
        r2 = x**2 + y**2
        radial = (1 + k1 * r2 + k2 * r2**2 + k3 * r2**3) / (1 + k4 * r2 + k5 * r2**2 + k6 * r2**3)
        expected = (
            x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x**2),
            y * radial + p1 * (r2 + 2 * y**2) + 2 * p2 * x * y,
        )
        got = distorted(Lens("brown", RATIONAL), np.array([x]), np.array([y]))
        np.testing.assert_allclose(np.ravel(got), expected, atol=1e-12)


def test_equidistant_model_keeps_angles() -> None:
    x, y = distorted(Lens("equidistant", (0.0,) * 4), np.array([np.tan(0.5)]), np.array([0.0]))
    assert x[0] == pytest.approx(0.5) and y[0] == 0
    k = (0.01, -0.02, 0.003, 0.001)
    angle = 0.7
    x, y = distorted(Lens("equidistant", k), np.array([0.0]), np.array([np.tan(angle)]))
    assert y[0] == pytest.approx(angle * (1 + k[0] * angle**2 + k[1] * angle**4 + k[2] * angle**6 + k[3] * angle**8))


def test_beyond_where_a_model_turns_back_nothing_is_known() -> None:
    lens = Lens("brown", (-0.3, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0))  # r - 0.3 r^3 turns at r = 1 / sqrt(0.9)
    turn = 1 / np.sqrt(0.9)
    x, _ = distorted(lens, np.array([0.0, turn - 0.02, turn + 0.02, 1.8]), np.zeros(4))
    assert np.isfinite(x[:2]).all() and np.isnan(x[2:]).all()


@pytest.mark.parametrize(
    ("model", "numbers", "expected"),
    [
        ("plumb_bob", (0.0,) * 5, None),
        ("", (), None),
        ("none", (0.0,) * 5, None),
        ("Brown Conrady", (0.1, 0, 0, 0, 0), Lens("brown", (0.1, 0, 0, 0, 0, 0, 0, 0))),
        ("plumb_bob", (0.1, 0.2, 0.3, 0.4), Lens("brown", (0.1, 0.2, 0.3, 0.4, 0, 0, 0, 0))),
        ("rational_polynomial", RATIONAL, Lens("brown", RATIONAL)),
        ("equidistant", (0.0,) * 4, Lens("equidistant", (0.0,) * 4)),
        ("KannalaBrandt8", (0.1, 0, 0, 0), Lens("equidistant", (0.1, 0, 0, 0))),
    ],
)
def test_names_of_models(model, numbers, expected) -> None:
    assert lens_of(model, numbers) == expected


@pytest.mark.parametrize(
    ("model", "numbers"),
    [
        ("inverse_brown_conrady", (0.1, 0, 0, 0, 0)),
        ("plumb_bob", (0.1, 0.2)),
        ("rational_polynomial", (*RATIONAL, 0.1, 0.0, 0.0, 0.0)),
        ("equidistant", (0.1,)),
        ("plumb_bob", (np.nan, 0, 0, 0, 0)),
    ],
)
def test_unknown_models_are_refused_in_one_line(model, numbers) -> None:
    with pytest.raises(UsageError, match="lens") as error:
        lens_of(model, numbers)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("lens", [Lens("brown", RATIONAL), Lens("equidistant", (0.02, 0.0, 0.0, 0.0))])
def test_a_slanted_plane_comes_out_flat(lens) -> None:
    """The bent image is made by inverting the model pixel by pixel with a root finder, along the radius."""
    if lens.model == "brown":
        lens = Lens(
            "brown", (*lens.coefficients[:2], 0.0, 0.0, *lens.coefficients[4:])
        )  # radial alone: one root a pixel
    normal, distance = np.array([0.3, -0.2, 1.0]), 1.5  # n x = d
    v, u = np.mgrid[0 : CAMERA.height, 0 : CAMERA.width]
    xd, yd = (u - CAMERA.cx) / CAMERA.fx, (v - CAMERA.cy) / CAMERA.fy
    rd = np.hypot(xd, yd)

    def bent(r: float) -> float:
        return float(distorted(lens, np.array([r]), np.array([0.0]))[0][0])

    table = np.linspace(0, rd.max(), 300)
    straight = np.interp(rd, table, [brentq(lambda r, t=t: bent(r) - t, 0, 3) for t in table])
    scale = np.where(rd > 0, straight / np.where(rd > 0, rd, 1), 1.0)
    rays = np.stack([xd * scale, yd * scale, np.ones_like(xd)], axis=-1)
    depth = (distance / (rays @ normal)).astype(np.float32)
    got = without_distortion(depth, lens, CAMERA, CAMERA)
    x, y = (u - CAMERA.cx) / CAMERA.fx, (v - CAMERA.cy) / CAMERA.fy
    expected = distance / (np.stack([x, y, np.ones_like(x)], axis=-1) @ normal)
    seen = got > 0
    assert seen.mean() > 0.6
    assert np.abs(got - expected)[seen].max() < 1e-3
    assert np.abs(depth - expected).max() > 0.02  # it matters


def test_edges_and_holes_are_not_smeared() -> None:
    depth = np.full((240, 320), 1.0, np.float32)
    depth[:, 200:], depth[100:110, 50:60] = 2.0, 0.0
    got = without_distortion(depth, Lens("brown", RATIONAL), CAMERA, CAMERA)
    assert set(np.unique(np.round(got, 4))) == {0.0, 1.0, 2.0}


def surface_distance(points: np.ndarray) -> np.ndarray:
    """Distances [m] from the scene of the cases: floor z = 0, wall x = 1.5, a box."""
    low, high = np.array([0.9, -0.15, -1.0]), np.array([1.1, 0.15, 0.3])
    q = np.abs(points - (low + high) / 2) - (high - low) / 2
    box = np.linalg.norm(np.maximum(q, 0), axis=1) + np.minimum(q.max(axis=1), 0)
    return np.abs([points[:, 2], points[:, 0] - 1.5, box]).min(axis=0)


def world_points(frame) -> np.ndarray:
    v, u = np.nonzero(frame.depth)
    z, i = frame.depth[v, u].astype(float), frame.intrinsics
    return np.stack([(u - i.cx) / i.fx * z, (v - i.cy) / i.fy * z, z], axis=1) @ frame.rotation.T + frame.position


@pytest.mark.parametrize("name", ["plain", "azure"])
def test_bags_with_and_without_distortion_show_the_same_room(shared_cases, name) -> None:
    pytest.importorskip("rosbags", reason="rosbags is an optional part: pip install hrcjax[bags]")
    source = open_input(shared_cases / "bag_distortion" / name)
    d = surface_distance(np.concatenate([world_points(frame) for frame in source]))
    assert np.median(d) < 3e-4 and np.quantile(d, 0.99) < 1e-3 and d.max() < 0.01
    assert ("undistorted by /depth/camera_info" in " ".join(source.notes)) == (name == "azure")
    raw = open_input(shared_cases / "bag_distortion" / name, intrinsics=Intrinsics(130, 130, 79.5, 59.5, 160, 120))
    d = surface_distance(np.concatenate([world_points(frame) for frame in raw]))
    assert (d.max() > 0.05) == (name == "azure")  # intrinsics that are given are of straight images
