"""The part nearest to a place, its speed, and when they count."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest
from standing import person_of, pose

from hrcjax.body import BodyFit, BodyParams, ahead, joints_of, measured_speed, nearest_part
from hrcjax.body.skeleton import USUAL_LENGTHS, USUAL_RADII
from hrcjax.safety.pfl import BODY_REGIONS

PARAMS = BodyParams()


def fit_with(velocity: tuple[float, float, float], deviation: float = 0.05) -> BodyFit:
    joints = joints_of(person_of(pose()))[0]
    every = jnp.broadcast_to(jnp.eye(3), (11, 3, 3))
    return BodyFit(
        joints, jnp.asarray(USUAL_RADII), jnp.broadcast_to(jnp.asarray(velocity), (11, 3)), 1e-4 * every, deviation**2 * every,
        jnp.asarray(USUAL_LENGTHS), jnp.full((10,), 9.0), jnp.zeros((10,)), jnp.asarray(1.0), jnp.asarray(2.0), jnp.asarray(True),
        jnp.full((4, 3), 100.0),
    )  # fmt: skip


@pytest.mark.parametrize(
    ("joint", "off", "region"),
    [(9, (0.0, -0.3, 0.0), "hand"), (2, (0.0, 0.0, 0.4), "face"), (5, (0.4, 0.1, 0.0), "upper arm")],
)
def test_the_region_of_the_nearest_part(joint: int, off: tuple[float, float, float], region: str) -> None:
    fit = fit_with((0.0, 0.0, 0.0))
    found = nearest_part(PARAMS, fit, fit.joints[joint] + jnp.asarray(off))
    assert BODY_REGIONS[int(found.region)].name.startswith(region)


def test_a_speed_towards_the_place_is_measured_and_raised() -> None:
    fit = fit_with((0.0, -0.4, 0.0))
    x = fit.joints[9] + jnp.asarray([0.0, -0.5, 0.0])
    found = nearest_part(PARAMS, fit, x)
    np.testing.assert_allclose(found.speed, 0.4, atol=1e-5)
    bound = measured_speed(PARAMS, fit, x, 0.1, 1.6)
    np.testing.assert_allclose(bound, 0.4 + PARAMS.deviations * 0.05 + 0.1 * PARAMS.human_acceleration, atol=1e-4)
    away = measured_speed(PARAMS, fit_with((0.0, 5.0, 0.0)), x, 0.1, 1.6)
    assert float(away) == 0.0


@pytest.mark.parametrize("what", ["young", "unseen", "vague", "lost", "unexplained"])
def test_what_is_not_sure_is_assumed(what: str) -> None:
    fit = fit_with((0.0, 0.0, 0.0))
    changed = {
        "young": (lambda f: f.age, jnp.asarray(0.1)),
        "unseen": (lambda f: f.unseen, jnp.full((10,), 0.5)),
        "vague": (lambda f: f.place_covariance, 100 * fit.place_covariance),
        "lost": (lambda f: f.tracked, jnp.asarray(False)),
        "unexplained": (lambda f: f.explained, jnp.asarray(0.4)),
    }[what]
    x = fit.joints[9] + jnp.asarray([0.0, -0.5, 0.0])
    assert float(measured_speed(PARAMS, fit, x, 0.1, 1.6)) < 1.0
    assert float(measured_speed(PARAMS, eqx.tree_at(*changed[:1], fit, changed[1]), x, 0.1, 1.6)) == pytest.approx(1.6)


def test_what_lies_ahead_is_less_sure() -> None:
    fit = fit_with((0.5, 0.0, 0.0))
    near, some = ahead(PARAMS, fit, 0.1)
    far, more = ahead(PARAMS, fit, 0.3)
    np.testing.assert_allclose(far - near, np.broadcast_to([0.1, 0.0, 0.0], (11, 3)), atol=1e-6)
    assert (np.asarray(more) > np.asarray(some)).all()
    expected = np.sqrt(1e-4 + 0.09 * 0.05**2 + (0.5 * PARAMS.acceleration[5] * 0.09) ** 2)
    np.testing.assert_allclose(more[7], expected, rtol=1e-4)
