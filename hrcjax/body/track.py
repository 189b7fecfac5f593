"""The body, frame by frame: predicted, fitted, corrected; begun anew where there is no track."""

import equinox as eqx
import jax
import jax.numpy as jnp

from hrcjax.body.facing import OTHER_PART, SETTLE, TURNED, facing_evidence, spun, turned_round
from hrcjax.body.guess import EVERY, FRONT, KINDS, farthest_hand, guess_bodies, poles, reaching_arm
from hrcjax.body.least_squares import Problem, cost, fit_body, inverse_spd, joined, normal_equations, split
from hrcjax.body.motion import averaged_scatter, corrected, predict
from hrcjax.body.params import BodyParams
from hrcjax.body.priors import Landmarks, frame_of
from hrcjax.body.skeleton import ARMS, HIP, LEFT, NECK_BASE, PARTS, RADIUS_NAMES, RIGHT
from hrcjax.body.state import KNOWN, PLACES, SHAPE, BodyFit, BodyState, initial_body
from hrcjax.body.surface import Near
from hrcjax.geom.cloud import Cloud
from hrcjax.geom.segment import FAR
from hrcjax.numerics import require_floating
from hrcjax.typing import Array, Bool, Float, Int, Mask, Points, Scalar, Vector3

MUCH = 0.15
"""Share of its cost by which another body must be better to replace one, besides `BodyParams.better` [1]."""
LOOSE = 1.0
"""Information about every joint of a first guess [1/m^2]."""
ARM_STEPS = 4
"""Steps of an arm that is tried elsewhere: what is found is fitted further in the next frame."""
LEFT_OVER = 4.0
"""Points that no part explains with which an arm is looked for elsewhere [1]."""
FACING = 2.0
"""Weight of the evidence of where a first guess faces [1]."""
ANYWHERE = 0.3
"""Standard deviation of the joints of a first guess [m]."""
ORDER = (*FRONT, *EVERY[: len(KINDS)], *FRONT, *EVERY[len(KINDS) :])
"""Order in which first guesses are tried: those that face the robot, as people mostly do, three times as often."""
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
    landmarks = jax.tree.map(lambda a: a.astype(points.dtype), landmarks)

    if params.warm:
        nothing = state, _nowhere(cloud)
        after, near = jax.lax.cond(state.tracked, lambda: _follow(params, state, cloud, dt, landmarks), lambda: nothing)
        share, _ = _explained(params, cloud, near)
        doubtful = ~state.tracked | (share < params.doubtful) | (state.age < params.young)
        after, near, new = jax.lax.cond(
            doubtful,
            lambda: _second_opinion(params, after, near, cloud, eye, landmarks),
            lambda: (eqx.tree_at(lambda s: s.turn, after, next_rivals(params, after.turn)), near, jnp.asarray(False)),
        )
    else:
        after, near, new = _second_opinion(
            params, initial_body(params, points.dtype), _nowhere(cloud), cloud, eye, landmarks
        )
    after, seen, share = _judge(params, state, after, cloud, near, dt, new)
    places = after.covariance[:PLACES, :PLACES].reshape(11, 3, 11, 3)
    speeds = after.covariance[KNOWN:, KNOWN:].reshape(11, 3, 11, 3)
    each = jnp.arange(11)
    # errors of places stay from frame to frame, and corrections do not show them; those of speeds do
    of_speeds = jnp.maximum(after.scatter, params.scatter_limits[0])[:, None, None] * speeds[each, :, each]
    fit = BodyFit(
        after.joints, after.radii, after.speeds, places[each, :, each], of_speeds, after.lengths, seen, after.unseen,
        share, after.age, after.tracked, jnp.where((cloud.mask & (near.distance > params.strange))[:, None], cloud.points, FAR),
    )  # fmt: skip
    return after, fit


def _nowhere(cloud: Cloud) -> Near:
    """No body: every point is far from it."""
    zero = jnp.zeros_like(cloud.points[:, 0])
    return Near(zero + 1.0, jnp.zeros(zero.shape, jnp.int32), zero, jnp.zeros_like(cloud.points))


def _explained(params: BodyParams, cloud: Cloud, near: Near) -> tuple[Array, Array]:
    """Share of the points that lie on the surface [1], and which do."""
    close = cloud.mask & (jnp.abs(near.distance) < params.close)
    count = jnp.sum(cloud.mask, dtype=near.distance.dtype)
    return jnp.sum(close, dtype=count.dtype) / jnp.maximum(count, 1.0), close


def _judge(
    params: BodyParams, before: BodyState, after: BodyState, cloud: Cloud, near: Near, dt: Array, new: Array
) -> tuple[BodyState, Array, Array]:
    """Whether the track holds; points on each part, and the share of points that are explained.

    Args:
        new: whether the body is not that of the last frame.
    """
    dtype = cloud.points.dtype
    share, close = _explained(params, cloud, near)
    seen = jnp.sum(
        (near.part[:, None] == jnp.arange(len(PARTS), dtype=jnp.int32)) & close[:, None], axis=0, dtype=dtype
    )
    enough = jnp.sum(cloud.mask, dtype=dtype) >= params.least_points
    good = enough & (share >= params.explained) & jnp.all(jnp.isfinite(after.covariance))
    bad = jnp.where(good, 0.0, before.bad + 1.0).astype(dtype)
    tracked = jnp.where(new, good, before.tracked & (bad < params.bad_frames)) & jnp.all(jnp.isfinite(after.joints))
    last = jnp.where(new, jnp.inf, after.unseen)
    unseen = jnp.where(seen >= params.part_points, 0.0, last + dt)
    empty = initial_body(params, dtype)
    after = eqx.tree_at(
        lambda s: (s.unseen, s.age, s.bad, s.tracked),
        after,
        (unseen, jnp.where(new, 0.0, after.age + dt), bad, tracked),
    )
    kept = (before.lengths, before.radii, after.turn, after.rivals)
    gone = eqx.tree_at(lambda s: (s.lengths, s.radii, s.turn, s.rivals), empty, kept)
    return jax.tree.map(lambda a, b: jnp.where(tracked, a, b), after, gone), seen, share


def _problem(params: BodyParams, state: BodyState, cloud: Cloud, dt: Array, landmarks: Landmarks | None) -> Problem:
    information = inverse_spd(state.covariance[:KNOWN, :KNOWN])
    before = joined(state.joints, state.lengths, state.radii)
    share = jnp.minimum(dt / params.patience, 1.0)
    return Problem(cloud, before, information, share, landmarks)


def _finish(
    params: BodyParams, problem: Problem, predicted: BodyState, known: Float[Array, "known"], near: Near, dt: Array
) -> BodyState:
    A, _ = normal_equations(params, problem, known, near)
    joints, lengths, radii = split(known)
    speeds, covariance, ratio = corrected(predicted, known, problem.information, A)
    scatter = averaged_scatter(params, predicted, ratio, dt)
    return BodyState(
        joints, lengths, radii, speeds, covariance, scatter, predicted.unseen, predicted.age, predicted.bad,
        predicted.facing, predicted.turn, predicted.rivals, predicted.tracked,
    )  # fmt: skip


def _follow(
    params: BodyParams, state: BodyState, cloud: Cloud, dt: Array, landmarks: Landmarks | None
) -> tuple[BodyState, Near]:
    """A frame of a track."""
    predicted = predict(params, state, dt)
    problem = _problem(params, predicted, cloud, dt, landmarks)
    known, _, near = fit_body(params, problem, problem.before, params.iterations)
    left_over = cloud.mask & (near.distance > params.doubt)

    def elsewhere() -> tuple[Array, Near]:
        return _arm_elsewhere(params, problem, known, near, left_over)

    enough = jnp.sum(left_over, dtype=cloud.points.dtype) >= LEFT_OVER
    known, near = jax.lax.cond(enough, elsewhere, lambda: (known, near))
    after = _finish(params, problem, predicted, known, near, dt)
    gain = jnp.minimum(dt / SETTLE, 1.0)
    facing = state.facing + gain * (facing_evidence(after.joints, after.speeds) - state.facing)
    turn = facing < TURNED
    # a body turned round is a new one: what left and right were is not to be relied on. The age of one that turns as nobody does begins anew
    new = turn | spun(state.joints, after.joints, dt)
    fresh = jnp.where(turn, -facing, facing), jnp.where(new, 0.0, after.age)
    after = eqx.tree_at(lambda s: (s.facing, s.age), after, fresh)
    near = near._replace(part=jnp.where(turn, jnp.asarray(OTHER_PART, jnp.int32)[near.part], near.part))
    return turned_round(after, turn), near


def _arm_elsewhere(
    params: BodyParams, problem: Problem, known: Array, near: Near, left_over: Bool[Array, "point"]
) -> tuple[Array, Near]:
    """The fit, or one with an arm elsewhere, if that explains more.

    The hand is put to the farthest of the points that nothing explains; and to the farthest of these and the arm's own, as an upper arm may
    lie where the whole arm is. Of both ways the arm with which the cost is lower at once is fitted. What an arm was before counts, in both
    costs, no more than `ANYWHERE`.
    """
    joints, lengths, radii = split(known)
    forward, left, _ = frame_of(joints)
    hand, reach = radii[RADIUS_NAMES.index("hand")], lengths[4] + lengths[5] + lengths[6]
    starts, informations = [], []
    for side, parts, pole in zip((LEFT, RIGHT), ARMS, poles(forward, left), strict=True):
        shoulder = joints[side[0]]
        own = problem.cloud.mask & jnp.any(near.part[:, None] == jnp.asarray(parts, jnp.int32), axis=1)
        free = jnp.zeros((11, 3), bool).at[jnp.asarray(side[1:])].set(True).reshape(-1)
        informations.append(forget(problem.information, jnp.concatenate([free, jnp.zeros((SHAPE,), bool)])))
        ways = []
        for among in (left_over, left_over | own):
            target, _ = farthest_hand(
                problem.cloud.points, among, shoulder, joints[HIP], joints[NECK_BASE], reach, hand
            )
            arm = reaching_arm(lengths, shoulder, target, pole)
            ways.append(joined(joints.at[jnp.asarray(side[1:])].set(arm[1:]), lengths, radii))
        starts.append(jnp.stack(ways))
    start, information = jnp.stack(starts), jnp.stack(informations)  # (side way known), (side known known)

    def asked(side: Array) -> Problem:
        return problem._replace(information=information[side])

    def value_of(side: Array, one: Array) -> Array:
        value = cost(params, asked(side), one)[0]
        return jnp.where(jnp.isfinite(value), value, jnp.inf)

    sides = jnp.arange(2, dtype=jnp.int32)
    at_once = jax.vmap(lambda side: jax.vmap(lambda one: value_of(side, one))(start[side]))(sides)
    chosen = jnp.argmin(at_once, axis=0)  # of every way
    mine = jax.vmap(lambda side: value_of(side, known))(chosen)
    tried, values, nears = jax.vmap(lambda side, way: fit_body(params, asked(side), start[side, way], ARM_STEPS))(
        chosen, sides
    )
    gains = jnp.where(jnp.isfinite(values), mine - values, -jnp.inf)
    best = jnp.argmax(gains)
    better = gains[best] > params.better
    return jax.tree.map(lambda a, b: jnp.where(better, a[best], b), (tried, nears), (known, near))


def forget(information: Float[Array, "known known"], free: Bool[Array, "known"]) -> Float[Array, "known known"]:
    """The information without what it says of some unknowns, which may be anywhere."""
    both = free[:, None] | free[None, :]
    some = jnp.where(both, 0.0, information)
    return some + jnp.diag(jnp.where(free, 1.0 / ANYWHERE**2, 0.0))


def next_rivals(params: BodyParams, turn: Int[Array, ""]) -> Int[Array, ""]:
    """The turn in which other bodies are begun anew."""
    return -(-turn // params.rival_frames) * params.rival_frames


def _second_opinion(
    params: BodyParams, state: BodyState, near: Near, cloud: Cloud, eye: Vector3 | None, landmarks: Landmarks | None
) -> tuple[BodyState, Near, Bool[Array, ""]]:
    """The body, or a better one of some that begin as first guesses and are fitted over a few frames; and whether it is that.

    Bodies are compared by points and priors alone, whatever was before.
    """
    dtype = cloud.points.dtype
    empty = initial_body(params, dtype)

    def begun() -> Float[Array, "rival known"]:
        which = jnp.asarray(EVERY)
        if params.warm:
            turn = state.turn // params.rival_frames * params.guesses + jnp.arange(params.guesses, dtype=jnp.int32)
            which = jnp.asarray(ORDER, jnp.int32)[turn % len(ORDER)]
        guesses = guess_bodies(cloud, state.lengths, state.radii, eye, which)
        return jax.vmap(lambda joints: joined(joints, state.lengths, state.radii))(guesses)

    fresh = state.turn % params.rival_frames == 0
    starts = jax.lax.cond(fresh, begun, lambda: state.rivals) if params.warm else begun()
    variances = jnp.diagonal(empty.covariance)[PLACES:KNOWN]
    shape = jnp.concatenate([jnp.zeros((PLACES,), dtype), 1.0 / variances])

    def problem(joints: Array) -> Problem:
        before = joined(joints, empty.lengths, empty.radii)
        return Problem(cloud, before, jnp.diag(jnp.where(shape == 0, LOOSE, shape)), jnp.asarray(1.0, dtype), landmarks)

    def value_of(known: Array) -> Array:
        joints = split(known)[0]
        return cost(params, problem(joints), known)[0] - FACING * facing_evidence(joints, empty.speeds)

    def refined(begin: Array) -> tuple[Array, Array, Near]:
        known, _, near = fit_body(params, problem(split(begin)[0]), begin, params.start_iterations)
        return known, value_of(known), near

    found, values, nears = jax.vmap(refined)(starts)
    values = jnp.where(jnp.isfinite(values), values, jnp.inf)
    best = jnp.argmin(values)
    mine = value_of(joined(state.joints, state.lengths, state.radii))
    fitted = (state.turn + 1) % params.rival_frames == 0
    new = ~state.tracked | (fitted & (values[best] < mine - params.better - MUCH * jnp.abs(mine)))

    def another() -> tuple[BodyState, Near]:
        wide = jnp.full((PLACES,), ANYWHERE**2, dtype)
        speeds = jnp.full((PLACES,), UNKNOWN_SPEED**2, dtype)
        joints, lengths, radii = split(found[best])
        beginning = BodyState(
            joints, lengths, radii, empty.speeds, jnp.diag(jnp.concatenate([wide, variances, speeds])), empty.scatter, empty.unseen,
            empty.age, empty.bad, empty.facing, state.turn, state.rivals, empty.tracked,
        )  # fmt: skip
        information = jnp.diag(1.0 / jnp.concatenate([wide, variances]))
        there = jax.tree.map(lambda a: a[best], nears)
        asked = problem(joints)._replace(information=information)
        return _finish(params, asked, beginning, found[best], there, jnp.zeros((), dtype)), there

    after, near = jax.lax.cond(new, another, lambda: (state, near))
    if not params.warm:
        return after, near, new
    return eqx.tree_at(lambda s: (s.turn, s.rivals), after, (state.turn + 1, found)), near, new
