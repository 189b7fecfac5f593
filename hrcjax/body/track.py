"""The body, frame by frame: predicted, fitted, corrected; begun anew where there is no track."""

import equinox as eqx
import jax
import jax.numpy as jnp

from hrcjax.body.facing import OTHER_PART, SETTLE, TURNED, facing_evidence, turned_round
from hrcjax.body.guess import farthest_hand, guess_bodies, poles, reaching_arm
from hrcjax.body.least_squares import Problem, cost, fit_body, joined, normal_equations, scaled_solve, split
from hrcjax.body.motion import corrected, predict
from hrcjax.body.params import BodyParams
from hrcjax.body.priors import Landmarks, frame_of
from hrcjax.body.skeleton import HIP, LEFT, NECK_BASE, PARTS, RADIUS_NAMES, RIGHT
from hrcjax.body.state import KNOWN, PLACES, SHAPE, BodyFit, BodyState, initial_body
from hrcjax.body.surface import Near
from hrcjax.geom.cloud import Cloud
from hrcjax.numerics import require_floating
from hrcjax.typing import Array, Bool, Float, Mask, Points, Scalar, Vector3

REFINED = 3
"""First guesses that are refined, the best before."""
LEFT_OVER = 4.0
"""Points that no part explains with which an arm is looked for elsewhere [1]."""
FACING = 2.0
"""Weight of the evidence of where a first guess faces [1]."""
ANYWHERE = 0.3
"""Standard deviation of the joints of a first guess [m]."""
UNKNOWN_SPEED = 1.0
"""The same of their speeds [m/s]."""


def track_body(
    params: BodyParams,
    state: BodyState,
    points: Points,
    mask: Mask,
    dt: Scalar,
    eye: Vector3 | None = None,
    landmarks: Landmarks | None = None,
) -> tuple[BodyState, BodyFit]:
    """The body after one frame.

    Args:
        params: weights and priors.
        state: after the last frame; `initial_body` before the first.
        points: of people, all of one moment [m].
        mask: which of them exist.
        dt: time since the last frame [s].
        eye: from where they were seen; used for first guesses alone [m].
        landmarks: joints that somebody else found; they pull, and replace nothing.

    Raises:
        ValueError: points that are not floating point.
    """
    require_floating("track_body", points=points)
    cloud = Cloud(points, mask & jnp.all(jnp.isfinite(points), axis=-1))
    cloud = Cloud(jnp.where(cloud.mask[:, None], points, 0.0), cloud.mask)
    dt = jnp.asarray(dt, points.dtype)

    def goes_on() -> tuple[BodyState, Near]:
        return _follow(params, state, cloud, dt, landmarks)

    def begins() -> tuple[BodyState, Near]:
        return _begin(params, state, cloud, dt, eye, landmarks)

    if params.warm:
        after, near = jax.lax.cond(state.tracked, goes_on, begins)
    else:
        after, near = begins()
    after, seen, share = _judge(params, state, after, cloud, near, dt)
    places = after.covariance[:PLACES, :PLACES].reshape(11, 3, 11, 3)
    speeds = after.covariance[KNOWN:, KNOWN:].reshape(11, 3, 11, 3)
    each = jnp.arange(11)
    fit = BodyFit(
        after.joints, after.radii, after.speeds, places[each, :, each], speeds[each, :, each], after.lengths, seen, after.unseen,
        share, after.age, after.tracked,
    )  # fmt: skip
    return after, fit


def _judge(
    params: BodyParams, before: BodyState, after: BodyState, cloud: Cloud, near: Near, dt: Array
) -> tuple[BodyState, Array, Array]:
    """Whether the track holds; points on each part, and the share of points that are explained."""
    dtype = cloud.points.dtype
    close = cloud.mask & (jnp.abs(near.distance) < params.doubt)
    seen = jnp.sum((near.part[:, None] == jnp.arange(len(PARTS))) & close[:, None], axis=0, dtype=dtype)
    count = jnp.sum(cloud.mask, dtype=dtype)
    share = jnp.sum(close, dtype=dtype) / jnp.maximum(count, 1.0)
    good = (count >= params.least_points) & (share >= params.explained) & jnp.all(jnp.isfinite(after.joints))
    went_on = before.tracked & params.warm
    bad = jnp.where(good, 0.0, before.bad + 1.0).astype(dtype)
    tracked = jnp.where(went_on, bad < params.bad_frames, good)
    unseen = jnp.where(seen >= params.part_points, 0.0, jnp.where(went_on, before.unseen, jnp.inf) + dt)
    age = jnp.where(went_on, before.age + dt, 0.0)
    shape = initial_body(params, dtype)
    lost = ~tracked
    variances = jnp.diagonal(before.covariance)[PLACES:KNOWN]
    kept = shape.covariance.at[jnp.arange(PLACES, KNOWN), jnp.arange(PLACES, KNOWN)].set(variances)

    def choose(a: Array, b: Array) -> Array:
        return jnp.where(lost, a, b)

    state = BodyState(
        joints=choose(before.joints, after.joints),
        lengths=choose(before.lengths, after.lengths),
        radii=choose(before.radii, after.radii),
        speeds=choose(shape.speeds, after.speeds),
        covariance=choose(kept, after.covariance),
        unseen=choose(shape.unseen, unseen),
        age=choose(shape.age, age),
        bad=bad,
        facing=choose(shape.facing, after.facing),
        tracked=tracked,
    )
    return state, seen, share


def _problem(params: BodyParams, state: BodyState, cloud: Cloud, dt: Array, landmarks: Landmarks | None) -> Problem:
    P = state.covariance[:KNOWN, :KNOWN]
    information = scaled_solve(P, jnp.eye(KNOWN, dtype=P.dtype))
    before = joined(state.joints, state.lengths, state.radii)
    share = jnp.minimum(dt / params.patience, 1.0)
    return Problem(cloud, before, 0.5 * (information + information.T), share, landmarks)


def _finish(
    params: BodyParams, problem: Problem, predicted: BodyState, known: Float[Array, "known"], near: Near
) -> BodyState:
    A, _ = normal_equations(params, problem, known, near)
    joints, lengths, radii = split(known)
    speeds, covariance = corrected(predicted, known, A)
    return BodyState(
        joints, lengths, radii, speeds, covariance, predicted.unseen, predicted.age, predicted.bad,
        predicted.facing, predicted.tracked,
    )  # fmt: skip


def _follow(
    params: BodyParams, state: BodyState, cloud: Cloud, dt: Array, landmarks: Landmarks | None
) -> tuple[BodyState, Near]:
    """A frame of a track."""
    predicted = predict(params, state, dt)
    problem = _problem(params, predicted, cloud, dt, landmarks)
    known, value, near = fit_body(params, problem, problem.before, params.iterations)
    left_over = cloud.mask & (near.distance > params.doubt)

    def elsewhere() -> tuple[Array, Near]:
        return _arms_elsewhere(params, problem, known, value, near, left_over)

    enough = jnp.sum(left_over, dtype=cloud.points.dtype) >= LEFT_OVER
    known, near = jax.lax.cond(enough, elsewhere, lambda: (known, near))
    after = _finish(params, problem, predicted, known, near)
    gain = jnp.minimum(dt / SETTLE, 1.0)
    facing = state.facing + gain * (facing_evidence(after.joints, after.speeds) - state.facing)
    turn = facing < TURNED
    after = eqx.tree_at(lambda s: s.facing, after, jnp.where(turn, -facing, facing))
    near = near._replace(part=jnp.where(turn, jnp.asarray(OTHER_PART)[near.part], near.part))
    return turned_round(after, turn), near


def _arms_elsewhere(
    params: BodyParams, problem: Problem, known: Array, value: Array, near: Near, left_over: Bool[Array, "point"]
) -> tuple[Array, Near]:
    """The fit, or one with an arm put to points that nothing explains, if that explains more.

    What an arm was before counts against it no more than `ANYWHERE`.
    """
    joints, lengths, radii = split(known)
    forward, left, _ = frame_of(joints)
    hand, reach = radii[RADIUS_NAMES.index("hand")], lengths[4] + lengths[5] + lengths[6]
    guesses, informations = [], []
    for side, pole in zip((LEFT, RIGHT), poles(forward, left), strict=True):
        shoulder = joints[side[0]]
        target, _ = farthest_hand(
            problem.cloud.points, left_over, shoulder, joints[HIP], joints[NECK_BASE], reach, hand
        )
        arm = reaching_arm(lengths, shoulder, target, pole)
        moved = joints.at[jnp.asarray(side[1:])].set(arm[1:])
        guesses.append(joined(moved, lengths, radii))
        free = jnp.zeros((11, 3), bool).at[jnp.asarray(side[1:])].set(True).reshape(-1)
        free = jnp.concatenate([free, jnp.zeros((SHAPE,), bool)])
        informations.append(forget(problem.information, free))
    starts = jnp.stack(guesses)

    def fit(start: Array, information: Array) -> tuple[Array, Array, Near]:
        return fit_body(params, problem._replace(information=information), start, params.iterations)

    tried, costs, nears = jax.vmap(fit)(starts, jnp.stack(informations))
    best = jnp.argmin(jnp.where(jnp.isfinite(costs), costs, jnp.inf))
    better = costs[best] < value - params.better
    return jax.tree.map(lambda a, b: jnp.where(better, a[best], b), (tried, nears), (known, near))


def forget(information: Float[Array, "known known"], free: Bool[Array, "known"]) -> Float[Array, "known known"]:
    """The information without what it says of some unknowns, which may be anywhere."""
    both = free[:, None] | free[None, :]
    some = jnp.where(both, 0.0, information)
    return some + jnp.diag(jnp.where(free, 1.0 / ANYWHERE**2, 0.0))


def _begin(
    params: BodyParams, state: BodyState, cloud: Cloud, dt: Array, eye: Vector3 | None, landmarks: Landmarks | None
) -> tuple[BodyState, Near]:
    """The best of several first guesses."""
    dtype = cloud.points.dtype
    guesses = guess_bodies(cloud, state.lengths, state.radii, eye)
    variances = jnp.diagonal(state.covariance)[PLACES:KNOWN]
    wide = jnp.full((PLACES,), ANYWHERE**2, dtype)
    speeds = jnp.full((PLACES,), UNKNOWN_SPEED**2, dtype)
    empty = initial_body(params, dtype)

    def begun(joints: Array) -> tuple[BodyState, Problem]:
        body = BodyState(
            joints, state.lengths, state.radii, empty.speeds, jnp.diag(jnp.concatenate([wide, variances, speeds])),
            empty.unseen, empty.age, empty.bad, empty.facing, empty.tracked,
        )  # fmt: skip
        information = jnp.diag(1.0 / jnp.concatenate([wide, variances]))
        before = joined(joints, state.lengths, state.radii)
        return body, Problem(cloud, before, information, jnp.asarray(1.0, dtype), landmarks)

    def first(joints: Array) -> Array:
        _, problem = begun(joints)
        return cost(params, problem, problem.before)[0] - FACING * facing_evidence(joints, empty.speeds)

    values = jax.vmap(first)(guesses)
    _, order = jax.lax.top_k(-jnp.where(jnp.isfinite(values), values, jnp.inf), REFINED)

    def refined(joints: Array) -> tuple[Array, Array, Near]:
        _, problem = begun(joints)
        known, value, near = fit_body(params, problem, problem.before, params.start_iterations)
        return known, value - FACING * facing_evidence(split(known)[0], empty.speeds), near

    chosen = guesses[order]
    found, values, nears = jax.vmap(refined)(chosen)
    best = jnp.argmin(jnp.where(jnp.isfinite(values), values, jnp.inf))
    body, problem = begun(chosen[best])
    near = jax.tree.map(lambda a: a[best], nears)
    return _finish(params, problem, body, found[best], near), near
