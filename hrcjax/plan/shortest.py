"""The shortest smooth path of an arm that keeps its distances: Gauss-Newton steps for many guesses and problems at once.

What `arm_optimise` does for any potential and any obstacles, without repulsion and for obstacles that are rounded boxes: one
residual for each sphere and obstacle near to it, and one for each pair of capsules, in a tenth of the time.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from hrcjax.geom.segment import FAR
from hrcjax.numerics import computed
from hrcjax.plan.arm_optimise import Inner, damped_solve, no_longer
from hrcjax.plan.contacts import SURFACES, contacts, least_gaps
from hrcjax.plan.hinge import hinge
from hrcjax.plan.joint_spline import spline_matrix
from hrcjax.plan.link_model import LinkModel
from hrcjax.plan.rounded_boxes import RoundedBoxes
from hrcjax.typing import Array, Float, Joints, Scalar

_AT_ONCE = 8
"""Contacts that are summed in one turn of a loop."""


class ShortestParams(NamedTuple):
    """Numbers of the optimiser."""

    gap: float = 0.02
    """Distance kept from obstacles and floor, where the ends allow it [m]."""
    self_gap: float = 0.005
    """Distance that links keep from each other, where the ends allow it [m]."""
    bending: float = 1e-3
    """Weight of the bending energy against the length [rad]."""
    opening: float = 0.1
    """Where an end is nearer than that: growth of the distance asked for, per turn away from the end [m/rad]."""
    penalty: float = 20000.0
    """Stiffness of a violated constraint [1/m^2 rad]."""
    penalty_first: float = 0.03
    """Share of this stiffness in the first step [1]."""
    damping: float = 0.001
    """Added to the diagonal of the Gauss-Newton matrix, as a share of it [1]."""
    move_max: float = 0.5
    """Longest move of a control point in one step [rad]."""
    lever: float = 0.3
    """Length that an angle beyond a joint's range counts as [m/rad]."""
    margin: float = 0.001
    """Distance beyond the required one that the penalties ask for [m]."""


class Problem(NamedTuple):
    """From one configuration to another among obstacles."""

    start: Joints
    goal: Joints
    solids: RoundedBoxes
    ends: tuple[Float[Array, "place two"], Float[Array, "pair two"]]
    """Gaps at start and goal, as `least_gaps` has them [m]."""


def problem(model: LinkModel, start: Joints, goal: Joints, solids: RoundedBoxes) -> Problem:
    """A problem with the gaps at its ends."""
    return Problem(start, goal, solids, least_gaps(model, jnp.stack([start, goal]), solids))


def _asked(
    params: ShortestParams, at: Problem, q: Float[Array, "sample joint"]
) -> tuple[Float[Array, "place sample"], Float[Array, "pair sample"]]:
    """The gaps asked for along the path [m]: where less is free at an end, it opens from there."""
    steps = jnp.sqrt(jnp.sum(jnp.diff(q, axis=0) ** 2, axis=1))
    along = jnp.concatenate([jnp.zeros(1, q.dtype), jnp.cumsum(steps)])
    opened = params.opening * along - params.margin, params.opening * (along[-1] - along) - params.margin

    def allowed(gap: Scalar, ends: Float[Array, "place two"]) -> Array:
        opening = jnp.minimum(ends[:, :1] + opened[0], ends[:, 1:] + opened[1])
        return jnp.minimum(jnp.asarray(gap, q.dtype), opening)

    return allowed(params.gap, at.ends[0]), allowed(params.self_gap, at.ends[1])


def configurations(at: Problem, inner: Inner, count: int) -> Float[Array, "sample joint"]:
    """Configurations along a path, evenly spaced in the parameter, its ends among them [rad]."""
    S = spline_matrix(inner.shape[0] + 2, np.linspace(0, 1, count))
    return jnp.asarray(S, inner.dtype) @ jnp.concatenate([at.start[None], inner, at.goal[None]])


class Quality(NamedTuple):
    """How good a path is."""

    length: Float[Array, ""]
    """In the joints [rad]."""
    gap: Float[Array, ""]
    """Least of all gaps at the samples, with the inflated spheres [m]."""
    missed: Float[Array, ""]
    """Most that a gap misses what is asked for [m]."""


def quality(model: LinkModel, params: ShortestParams, at: Problem, inner: Inner, samples: int) -> Quality:
    """Length and gaps of a path."""
    q = configurations(at, inner, samples)
    gaps, asked = least_gaps(model, q, at.solids), _asked(params, at, q)
    return Quality(
        jnp.sum(jnp.sqrt(jnp.sum(jnp.diff(q, axis=0) ** 2, axis=1))),
        jnp.minimum(jnp.min(gaps[0]), jnp.min(gaps[1], initial=FAR)),
        jnp.maximum(jnp.max(asked[0] - gaps[0]), jnp.max(asked[1] - gaps[1], initial=-FAR)),
    )


def shortest_step(
    model: LinkModel, params: ShortestParams, at: Problem, inner: Inner, stiffness: Scalar, samples: int
) -> Inner:
    """One Gauss-Newton step: minus the damped inverse of the matrix times the gradient [rad].

    Args:
        stiffness: of the penalties.
        samples: configurations at which the path is checked.
    """
    count, n = inner.shape
    dtype = inner.dtype
    places = np.linspace(0, 1, samples)
    whole = spline_matrix(count + 2, places)
    S = jnp.asarray(whole[:, 1:-1], dtype)
    q = configurations(at, inner, samples)
    found = contacts(model, q, at.solids)
    near, pairs = _asked(params, at, q)
    spheres = len(model.radii)
    # every obstacle of a sphere may come as near as the nearest one is at the ends
    near = jnp.concatenate([near[:spheres]] * SURFACES + [near[spheres:]])
    spares = [found[0].gap - near, found[1].gap - pairs]
    weight = stiffness / samples

    pushes, helds = [], []
    for spare in spares:
        _, push, held = hinge(spare - params.margin)
        pushes.append(push)
        helds.append(held)
    push, held = computed((jnp.asarray(weight * jnp.concatenate(pushes)), jnp.asarray(weight * jnp.concatenate(helds))))
    slope = computed(jnp.concatenate([c.slope for c in found]))
    by_q, bent = computed(_summed(slope, push, held))

    low, high = jnp.asarray(model.arm.q_min, dtype), jnp.asarray(model.arm.q_max, dtype)
    lever = jnp.asarray(params.lever, dtype)
    _, below, below_held = hinge(lever * (q - low).T - params.margin)
    _, above, above_held = hinge(lever * (high - q).T - params.margin)
    by_q = by_q + weight * lever * (above - below)
    ranged = weight * lever * lever * (above_held + below_held)
    bent = bent + jnp.eye(n, dtype=dtype)[:, :, None] * ranged

    # length and bending energy, of equal steps
    D = np.diff(whole, axis=0)
    E = np.diff(D, axis=0)
    control = jnp.concatenate([at.start[None], inner, at.goal[None]])
    steps = samples - 1
    first, second = jnp.asarray(D, dtype) @ control, jnp.asarray(E, dtype) @ control
    length = jnp.sqrt(steps * jnp.sum(first * first))
    energy = steps**3 / length**3 * jnp.sum(second * second)
    a, b = steps / length, 2 * params.bending * steps**3 / length**3
    stretched = a * (1 - 3 * params.bending * energy / length)
    first_square, second_square = (jnp.asarray(M[:, 1:-1].T @ M, dtype) for M in (D, E))
    gradient = (stretched * first_square + b * second_square) @ control + (by_q @ S).T

    tight = a * first_square[:, 1:-1] + b * second_square[:, 1:-1]
    products = (whole[:, 1:-1, None] * whole[:, None, 1:-1]).reshape(samples, count * count)
    blocks = (bent.reshape(n * n, samples) @ jnp.asarray(products, dtype)).reshape(n, n, count, count)
    blocks = blocks + jnp.eye(n, dtype=dtype)[:, :, None, None] * tight
    matrix = blocks.transpose(2, 0, 3, 1).reshape(count * n, count * n)
    return damped_solve(matrix, gradient, params.damping)


def _summed(
    slope: Float[Array, "contact joint sample"],
    push: Float[Array, "contact sample"],
    held: Float[Array, "contact sample"],
) -> tuple[Float[Array, "joint sample"], Float[Array, "joint joint sample"]]:
    """Gradient and Gauss-Newton matrix of every sample by its joints: minus the slopes by push, and their squares by held.

    A loop over some contacts at a time: as sums over all of them a CPU takes four times as long.
    """
    contact, n, samples = slope.shape
    short = -contact % _AT_ONCE
    slope, push, held = (jnp.pad(x, ((0, short), *[(0, 0)] * (x.ndim - 1))) for x in (slope, push, held))

    def add(k: Array, sums: tuple[Array, Array]) -> tuple[Array, Array]:
        by_q, bent = sums
        some = (jax.lax.dynamic_slice_in_dim(x, k * _AT_ONCE, _AT_ONCE) for x in (slope, push, held))
        for s, p, h in zip(*some, strict=True):
            by_q, bent = by_q - p * s, bent + (h * s)[:, None] * s
        return by_q, bent

    zero = jnp.zeros((n, samples), slope.dtype), jnp.zeros((n, n, samples), slope.dtype)
    return jax.lax.fori_loop(0, (contact + short) // _AT_ONCE, add, zero)


def shortened(
    model: LinkModel,
    params: ShortestParams,
    at: Problem,
    inner: Inner,
    samples: int,
    iterations: int,
    first: Scalar,
    last: Scalar = 1.0,
) -> Inner:
    """Gauss-Newton steps while the penalty stiffens from one share of its stiffness to another [rad].

    Args:
        iterations: number of steps; the last quarter has the last stiffness.
        first, last: shares of the stiffness [1].
    """
    dtype = inner.dtype
    part = jnp.minimum(jnp.linspace(0, 1.25, iterations, dtype=dtype), 1)
    stiffness = params.penalty * jnp.asarray(first, dtype) ** (1 - part) * jnp.asarray(last, dtype) ** part

    def step(inner: Inner, stiffness: Array) -> tuple[Inner, None]:
        move = shortest_step(model, params, at, inner, stiffness, samples)
        return inner + no_longer(move, params.move_max), None

    return jax.lax.scan(step, inner, stiffness)[0]


def guess_cost(
    model: LinkModel, params: ShortestParams, at: Problem, inner: Inner, samples: int, share: Scalar
) -> Float[Array, ""]:
    """Length and penalties of a guess, without the opening at the ends: to choose the best of many [rad].

    Args:
        share: of the stiffness [1].
    """
    q = configurations(at, inner, samples)
    near, pairs = least_gaps(model, q, at.solids)
    missed = jnp.sum(jnp.maximum(params.gap - near, 0) ** 2) + jnp.sum(jnp.maximum(params.self_gap - pairs, 0) ** 2)
    length = jnp.sum(jnp.sqrt(jnp.sum(jnp.diff(q, axis=0) ** 2, axis=1)))
    return length + share * params.penalty / (2 * samples) * missed
