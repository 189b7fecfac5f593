"""Lines held and the places they point at: against Monte Carlo, closed forms and finite differences."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from hrcjax.geom.shape import plane_distance, sphere_distance
from hrcjax.geom.sphere_trace import sphere_trace
from hrcjax.hand import (
    Line,
    PointingParams,
    held_line,
    held_points,
    initial_pointing,
    pointed_place,
    spread,
    update_pointing,
)

PARAMS = PointingParams(shared=0.0)
UP = jnp.asarray([0.0, 0.0, 1.0])
DT = 1 / 30


def table(x):
    return plane_distance(x, UP.astype(x.dtype), 0.0)


def unit(v):
    return v / np.linalg.norm(v)


def finger(tip, u):
    """Landmarks of an index from base to tip [m]."""
    return np.asarray(tip) - np.array([0.09, 0.045, 0.02, 0.0])[:, None] * np.asarray(u)


def hold(points, information, params=PARAMS, state=None, count=16):
    state = initial_pointing(len(points), UP.dtype) if state is None else state
    step = jax.jit(update_pointing)
    done = False
    for _ in range(count):
        state, done = step(params, state, jnp.asarray(points, float), jnp.asarray(information, float), True, DT)
    return state, bool(done)


@pytest.mark.parametrize("seed", range(5))
def test_sphere_tracing_meets_what_rays_meet(seed: int) -> None:
    rng = np.random.default_rng(seed)
    origin, centre = rng.normal(size=3) * [1, 1, 0.1] + [0, 0, 2], np.array([0.2, 0.1, 0.3])
    target = rng.uniform(-0.2, 0.2, 3) + centre
    u = unit(target - origin)

    def distance(x):
        return jnp.minimum(table(x), sphere_distance(x, jnp.asarray(centre, x.dtype), 0.3))

    b = (origin - centre) @ u
    root = b * b - ((origin - centre) @ (origin - centre) - 0.09)
    expected = min(-b - np.sqrt(root) if root >= 0 else np.inf, -origin[2] / u[2] if u[2] < 0 else np.inf)
    hit = sphere_trace(distance, jnp.asarray(origin, float), jnp.asarray(u, float), 10.0, 1e-5)
    assert bool(hit.found) and float(hit.t) == pytest.approx(expected, abs=2e-4)


def test_a_ray_away_from_everything_meets_nothing() -> None:
    hit = sphere_trace(table, UP, UP, 3.0)
    assert not bool(hit.found) and float(hit.t) == 3.0
    slope = jax.grad(lambda o: sphere_trace(table, o, UP, 3.0).t)(UP)
    np.testing.assert_array_equal(slope, 0.0)
    assert not bool(sphere_trace(lambda x: x[2] * jnp.nan, UP, -UP, 3.0).found)


def test_the_derivative_of_a_meeting_is_that_of_differences() -> None:
    with jax.enable_x64(True):
        origin, u = jnp.asarray([0.1, -0.2, 1.0]), jnp.asarray(unit(np.array([0.3, 0.2, -0.8])))

        def distance(x):
            return sphere_distance(x, jnp.asarray([0.4, 0.0, 0.0]), 0.35)

        def place(origin, u):
            return sphere_trace(distance, origin, u, 5.0, 1e-12, 300).point

        for k, slope in enumerate(jax.jacfwd(place, argnums=(0, 1))(origin, u)):
            for axis, move in enumerate(1e-6 * np.eye(3)):
                ahead, behind = (
                    place(*[v + side * move * (j == k) for j, v in enumerate((origin, u))]) for side in (1, -1)
                )
                np.testing.assert_allclose(slope[:, axis], (ahead - behind) / 2e-6, atol=1e-5)
        reverse = jax.jacrev(place)(origin, u)
        np.testing.assert_allclose(reverse, jax.jacfwd(place)(origin, u), atol=1e-12)


def test_a_line_is_held_after_half_a_second_and_not_before() -> None:
    points, known = finger([0, 0, 0.5], [0, 0, -1]), np.broadcast_to(1e4 * np.eye(3), (4, 3, 3))
    assert not hold(points, known, count=15)[1] and hold(points, known, count=16)[1]
    state, _ = hold(points, known)
    line = held_line(PARAMS, state)
    np.testing.assert_allclose(line.tip, [0, 0, 0.5], atol=1e-5)
    np.testing.assert_allclose(line.direction, [0, 0, -1], atol=1e-5)


def test_a_hand_that_moves_begins_anew_and_a_short_loss_does_not() -> None:
    points, known = finger([0, 0, 0.5], [0, 0, -1]), np.broadcast_to(1e4 * np.eye(3), (4, 3, 3))
    known = 1e3 * known  # 0.3 mm
    state, _ = hold(points, known, count=10)
    moved, done = hold(points + np.array([0.05, 0, 0]), known, state=state, count=1)
    assert float(moved.held) == 0 and not done
    np.testing.assert_allclose(held_points(moved)[-1], [0.05, 0, 0.5], atol=1e-5)
    kept, gone = state, state
    for k in range(6):
        gone, done = update_pointing(PARAMS, gone, jnp.full((4, 3), jnp.nan), jnp.asarray(known, float), True, DT)
        assert not bool(done), "what is no number never points"
        kept = gone if k == 2 else kept
    assert float(kept.held) == pytest.approx(float(state.held)) and float(gone.held) == 0 and float(gone.images) == 0


def test_what_is_known_badly_may_move_more() -> None:
    points = finger([0, 0, 0.5], [0, 0, -1])
    for deviation, stays in ((0.001, False), (0.02, True)):
        known = np.broadcast_to(np.eye(3) / deviation**2, (4, 3, 3))
        state, _ = hold(points, known, count=10)
        moved, _ = hold(points + np.array([0.05, 0, 0]), known, state=state, count=1)
        assert (float(moved.held) > 0) == stays


def test_the_covariance_of_a_place_is_that_of_many_draws() -> None:
    """A finger a metre from the table, aslant; errors of 5 mm in every landmark of every image."""
    rng = np.random.default_rng(0)
    tip, u = np.array([0.0, 0.0, 0.7]), unit(np.array([0.5, 0.1, -0.6]))
    sigma = 0.005
    known = np.broadcast_to(np.eye(3) / sigma**2, (4, 3, 3))
    measured = jnp.asarray(finger(tip, u) + rng.normal(0, sigma, (400, 16, 4, 3)), float)

    def played(images):
        def step(state, points):
            return update_pointing(PARAMS, state, points, jnp.asarray(known, float), True, DT)

        state, _ = jax.lax.scan(step, initial_pointing(4, UP.dtype), images)
        return pointed_place(PARAMS, held_line(PARAMS, state), table)

    places = jax.jit(jax.vmap(played))(measured)
    assert bool(places.found.all()) and not bool(places.touched.any())
    drawn = np.cov(np.asarray(places.place).T)
    told = np.asarray(places.covariance).mean(axis=0)
    truth = tip + u * 0.7 / -u[2]
    assert np.linalg.norm(np.asarray(places.place).mean(axis=0) - truth) < 0.01
    for one in (0, 1):  # fading counts less than it says: the weights of images are not equal
        assert 0.8 < np.sqrt(drawn[one, one] / told[one, one]) < 1.35


def test_shared_errors_do_not_fall_with_the_images() -> None:
    points, known = finger([0, 0, 0.5], [0, 0, -1]), np.broadcast_to(1e4 * np.eye(3), (4, 3, 3))
    state, _ = hold(points, known, count=60)
    whole, none = held_line(PointingParams(shared=1.0), state), held_line(PARAMS, state)
    ratio = np.diag(whole.covariance)[:2] / np.diag(none.covariance)[:2]
    np.testing.assert_allclose(ratio, float(state.images), rtol=1e-3)


def test_a_tip_at_a_surface_names_what_is_beside_it() -> None:
    line = Line(jnp.asarray([0.1, 0.2, 0.012]), jnp.asarray(unit(np.array([1.0, 0, -0.2])), float), 1e-6 * jnp.eye(6))
    place = pointed_place(PARAMS, line, table)
    assert bool(place.touched)
    np.testing.assert_allclose(place.place, [0.1, 0.2, 0.0], atol=1e-6)
    np.testing.assert_allclose(np.diag(place.covariance), [1e-6, 1e-6, 0.0], atol=1e-9)
    assert float(spread(place.covariance)) == pytest.approx(1e-3, rel=1e-3)
