"""Lines held and the places they point at: against Monte Carlo, closed forms and finite differences."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from hrcjax.geom.shape import box_distance, plane_distance, sphere_distance
from hrcjax.geom.sphere_trace import sphere_trace
from hrcjax.hand import (
    Line,
    PointingParams,
    drifts,
    held_covariances,
    held_line,
    held_points,
    initial_pointing,
    pointed_place,
    spread,
    update_pointing,
)

PARAMS = PointingParams(surface=0.0)
UP = jnp.asarray([0.0, 0.0, 1.0])
DT = 1 / 30


def table(x):
    return plane_distance(x, UP.astype(x.dtype), 0.0)


def unit(v):
    return v / np.linalg.norm(v)


def finger(tip, u):
    """Landmarks of an index from base to tip [m]."""
    return np.asarray(tip) - np.array([0.09, 0.045, 0.02, 0.0])[:, None] * np.asarray(u)


NONE = np.zeros((4, 3, 3))


def hold(points, information, params=PARAMS, state=None, count=16, common=NONE, velocity=0.0):
    """Images of landmarks that stand, or move with a velocity."""
    state = initial_pointing(len(points), UP.dtype) if state is None else state
    step = jax.jit(update_pointing)
    done = False
    for k in range(count):
        given = (jnp.asarray(x, float) for x in (points + k * DT * np.asarray(velocity), information, common))
        state, done = step(params, state, *given, True, DT)
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
    line = held_line(state)
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
        gone, done = update_pointing(
            PARAMS, gone, jnp.full((4, 3), jnp.nan), jnp.asarray(known, float), jnp.asarray(NONE), True, DT
        )
        assert not bool(done), "what is no number never points"
        kept = gone if k == 2 else kept
    assert float(kept.held) == pytest.approx(float(state.held)) and float(gone.held) == 0 and float(gone.images) == 0
    late, done = update_pointing(
        PARAMS, state, jnp.asarray(points, float), jnp.asarray(known, float), jnp.asarray(NONE), True, 2.0
    )
    assert float(late.held) == 0 and not bool(done), "an image after a pause is the first of another hand"


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
            return update_pointing(PARAMS, state, points, jnp.asarray(known, float), jnp.asarray(NONE, float), True, DT)

        state, _ = jax.lax.scan(step, initial_pointing(4, UP.dtype), images)
        return pointed_place(PARAMS, held_line(state), table)

    places = jax.jit(jax.vmap(played))(measured)
    assert bool(places.found.all()) and not bool(places.touched.any())
    drawn = np.cov(np.asarray(places.place).T)
    told = np.asarray(places.covariance).mean(axis=0)
    truth = tip + u * 0.7 / -u[2]
    assert np.linalg.norm(np.asarray(places.place).mean(axis=0) - truth) < 0.01
    for one in (0, 1):  # fading counts less than it says: the weights of images are not equal
        assert 0.8 < np.sqrt(drawn[one, one] / told[one, one]) < 1.35


def test_common_errors_do_not_fall_with_the_images() -> None:
    """A hundredth of the variance is common: after many images it is most of what is left."""
    points, known = finger([0, 0, 0.5], [0, 0, -1]), np.broadcast_to(1e4 * np.eye(3), (4, 3, 3))
    state, _ = hold(points, known, count=60, common=np.broadcast_to(1e-4 * np.eye(3), (4, 3, 3)))
    n = float(state.images)
    np.testing.assert_allclose(held_covariances(state)[2], 1e-4 * np.eye(3), rtol=1e-4, atol=1e-12)
    free, _ = hold(points, known, count=60)
    np.testing.assert_allclose(held_covariances(free)[2], 1e-4 * np.eye(3) / n, rtol=1e-4, atol=1e-12)
    ratio = np.diag(held_line(state).covariance)[:2] / np.diag(held_line(free).covariance)[:2]
    np.testing.assert_allclose(ratio, n, rtol=1e-3)


@pytest.mark.parametrize(("speed", "chooses"), [(0.0, True), (0.02, True), (0.06, False), (0.1, False)])
def test_a_hand_that_wanders_chooses_nothing(speed, chooses) -> None:
    """Its landmarks are never far from their mean, so that only their drift tells it."""
    points, known = finger([0, 0, 0.5], [0, 0, -1]), np.broadcast_to(1e6 * np.eye(3), (4, 3, 3))
    state, done = hold(points, known, count=24, velocity=[speed, 0, 0])
    assert float(state.held) > PARAMS.dwell and done == chooses == (not bool(drifts(PARAMS, state)))


def test_a_finger_that_turns_chooses_nothing() -> None:
    """About its middle, so that it does not wander."""
    known = np.broadcast_to(1e6 * np.eye(3), (4, 3, 3))
    for rate, chooses in ((0.05, True), (0.3, False)):
        points = finger([0, 0, 0.5], [0, 0, -1])
        swing = (points - points.mean(axis=0)) * [0, 0, 1]
        _, done = hold(points, known, count=20, velocity=rate * np.stack([swing[:, 2], *np.zeros((2, 4))], axis=1))
        assert done == chooses


def test_noise_is_no_drift() -> None:
    """Of hands that are held still nearly all are found soon, and of those that pass at 0.1 m/s nearly none; errors of 7 mm."""
    rng = np.random.default_rng(1)
    points, sigma = finger([0, 0, 0.5], [0, 0, -1]), 0.007
    known = jnp.asarray(np.broadcast_to(np.eye(3) / sigma**2, (4, 3, 3)), float)
    dt, count, hands = 1 / 15, 12, 200
    times = dt * np.arange(count)[None, :, None, None]
    way = rng.normal(size=(hands, 1, 1, 3))
    way /= np.linalg.norm(way, axis=-1, keepdims=True)

    def chosen(speed):
        noisy = points + speed * times * way + rng.normal(0, sigma, (hands, count, 4, 3))

        def one(images):
            def step(state, now):
                return update_pointing(PARAMS, state, now, known, jnp.asarray(NONE, float), True, dt)

            return jnp.any(jax.lax.scan(step, initial_pointing(4, known.dtype), images)[1])

        return float(jax.jit(jax.vmap(one))(jnp.asarray(noisy, float)).mean())

    assert chosen(0.0) >= 0.98 and chosen(0.15) <= 0.02


def test_beside_an_edge_a_place_is_not_known() -> None:
    """A line that meets a box 1 cm inside its edge, known to 2 cm there, may as well meet the table a metre behind."""

    def distance(x):
        box = box_distance(x, jnp.asarray([0.0, 0.0, 0.5], x.dtype), jnp.asarray([0.2, 0.2, 0.5], x.dtype))
        return jnp.minimum(table(x), box)

    tip = jnp.asarray([0.19, 0.0, 1.5])
    covariance = jnp.diag(jnp.asarray([4e-4, 4e-4, 4e-4, 0, 0, 0], tip.dtype))
    inside = pointed_place(PARAMS, Line(tip - 0.1 * jnp.eye(3)[0], -UP, covariance), distance)
    edge = pointed_place(PARAMS, Line(tip, -UP, covariance), distance)
    assert bool(inside.found) and bool(edge.found)
    assert float(spread(inside.covariance)) == pytest.approx(0.02, rel=0.05) and float(spread(edge.covariance)) > 0.2


def test_what_a_surface_is_off_counts_along_the_line() -> None:
    u = unit(np.array([1.0, 0.0, -1.0]))
    place = pointed_place(PointingParams(surface=0.01), Line(0.5 * UP, jnp.asarray(u, float), jnp.zeros((6, 6))), table)
    np.testing.assert_allclose(place.covariance, 2e-4 * np.outer(u, u), atol=1e-8)


def test_a_tip_at_a_surface_names_what_is_beside_it() -> None:
    line = Line(jnp.asarray([0.1, 0.2, 0.012]), jnp.asarray(unit(np.array([1.0, 0, -0.2])), float), 1e-6 * jnp.eye(6))
    place = pointed_place(PARAMS, line, table)
    assert bool(place.touched)
    np.testing.assert_allclose(place.place, [0.1, 0.2, 0.0], atol=1e-6)
    gap = (0.012 - PARAMS.finger) ** 2
    np.testing.assert_allclose(np.diag(place.covariance), [1e-6 + gap, 1e-6 + gap, gap], atol=1e-9)
    at_skin = line._replace(tip=jnp.asarray([0.1, 0.2, PARAMS.finger]))
    assert float(spread(pointed_place(PARAMS, at_skin, table).covariance)) == pytest.approx(1e-3, rel=1e-3)


@pytest.mark.parametrize(("gap", "told"), [(0.0, 0.004), (0.001, 0.004), (0.01, 0.01), (-0.006, 0.006)])
def test_at_a_tip_the_map_counts_once(gap: float, told: float) -> None:
    """A tip known exactly: along the normal what the surface is off or the gap, whichever is more; across the gap alone."""
    params = PointingParams(surface=0.004)
    tip = jnp.asarray([0.1, 0.2, params.finger + gap])
    place = pointed_place(params, Line(tip, -UP, jnp.zeros((6, 6), tip.dtype)), table)
    assert bool(place.touched)
    np.testing.assert_allclose(np.sqrt(np.diag(place.covariance)), [abs(gap), abs(gap), told], rtol=1e-3, atol=2e-6)


def test_a_tip_at_an_edge_that_the_map_has_rounded_off_is_covered() -> None:
    """Fingers on a box whose map has lost a centimetre and a half of every face: places beside them are off, and told to be."""
    rng, half, lost = np.random.default_rng(0), np.array([0.1, 0.1, 0.1]), 0.015
    x = rng.normal(size=(200, 3))
    x = np.clip(0.13 * x / np.abs(x).max(axis=1, keepdims=True), -half, half)  # many at edges and corners
    out = np.where(np.abs(x) >= half - 1e-9, np.sign(x), 0.0)
    tips = x + 0.01 * out / np.linalg.norm(out, axis=1, keepdims=True)

    def distance(x):
        return box_distance(x, jnp.zeros(3, x.dtype), jnp.asarray(half - lost, x.dtype))

    def one(tip):
        return pointed_place(PARAMS, Line(tip, -UP.astype(tip.dtype), 1e-6 * jnp.eye(6, dtype=tip.dtype)), distance)

    found = jax.jit(jax.vmap(one))(jnp.asarray(tips, float))
    off = np.linalg.norm(np.asarray(found.place) - x, axis=1)
    told = np.asarray(jax.vmap(spread)(found.covariance))
    assert bool(found.touched.all()) and np.median(off) > 0.012
    assert np.mean(off <= 2 * told) > 0.9 and np.median(told) < 0.03
