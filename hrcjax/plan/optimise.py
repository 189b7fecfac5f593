"""Shortest and straightest path that keeps its distance: minimise omega1 length + omega2 bending energy."""

import math
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from hrcjax.geom.length import length
from hrcjax.numerics import require_floating
from hrcjax.plan.band import band_solve
from hrcjax.plan.curve import equally_spaced
from hrcjax.plan.half_spaces import HalfSpaces, attainable_gap, half_spaces, push_back
from hrcjax.plan.objective import length_and_bending, with_bands
from hrcjax.plan.params import PathParams, PlanParams
from hrcjax.plan.path_result import PathResult, judge, required_distance
from hrcjax.plan.potential import DistancesFn
from hrcjax.typing import Array, Bool, Float, Scalar, Vector3

_WAVE = (4 * math.pi) ** 2
"""Square of the wave number, times the length of the path, at which constraint and path are compared."""
_MOVES = 2
"""Newton steps for each evaluation of the obstacles' distances."""
_INTO = 3.0
"""Farthest that a step goes beyond an obstacle's half-space, or deeper into it, over the reach of the push [1]."""
_SMOOTHING = 16.0
"""Weight of the squared second differences in smoothing the guess: waves shorter than 13 segments are damped."""
_LONG = (1.25, 1.5)
"""Lengths, over that of the guess, between which bending stops to lengthen the path. A bent path of twice the size
has half the bending energy, so that without this a path caught between obstacles grows without end."""


class _Task(NamedTuple):
    """What stays the same over all iterations."""

    path: PathParams
    waypoints: Float[Array, "waypoint 3"]
    """As given: their ends are start and goal [m]."""
    required: Float[Array, "obstacle"]
    """Gap asked for [m]."""
    at_start: Float[Array, "obstacle"]
    """Gap at the start [m]."""
    at_goal: Float[Array, "obstacle"]
    """Gap at the goal [m]."""
    lower: Vector3
    """Lower bounds [m]."""
    upper: Vector3
    """Upper bounds [m]."""
    guess_length: Float[Array, ""]
    """Length of the smoothed guess [m]."""
    place: Float[Array, "sample"]
    """Of the samples along the path [1]."""


class _Push(NamedTuple):
    """What constraints add to the waypoints between the ends: a force, and blocks of the Newton matrix."""

    force: Float[Array, "inner 3"]
    diagonal: Float[Array, "inner 3 3"]
    off: Float[Array, "pair 3 3"]


class _Stiffness(NamedTuple):
    """Of the path and of its constraints, in this step."""

    constraint: Array
    """Spring of a violated constraint."""
    unit: Array
    """Stiffness of the path to a wave of _WAVE."""
    softness: Array
    """Reach of the push of a constraint that is kept [m]."""


def _smooth(waypoints: Float[Array, "waypoint 3"]) -> Float[Array, "waypoint 3"]:
    """The path x with the least |x - waypoints|^2 + _SMOOTHING |second differences of x|^2 and the same ends."""
    count = waypoints.shape[0]
    differences = np.eye(count - 2, count) - 2 * np.eye(count - 2, count, k=1) + np.eye(count - 2, count, k=2)
    fourth = _SMOOTHING * (differences.T @ differences)[1:-1]
    move = np.linalg.solve(np.eye(count - 2) + fourth[:, 1:-1], -fourth)
    return waypoints.at[1:-1].add(jnp.asarray(move, waypoints.dtype) @ waypoints)


def _samples(waypoints: Float[Array, "waypoint 3"]) -> Float[Array, "sample 3"]:
    """The waypoints between start and goal, then the middles of all segments."""
    return jnp.concatenate([waypoints[1:-1], (waypoints[:-1] + waypoints[1:]) / 2])


def _places(count: int, dtype: jnp.dtype) -> Float[Array, "sample"]:
    """Where these lie along a path of `count` segments, 0 at the start and 1 at the goal [1]."""
    return jnp.concatenate([jnp.arange(1, count, dtype=dtype), jnp.arange(count, dtype=dtype) + 0.5]) / count


def _spread(samples: Float[Array, "sample *rest"]) -> tuple[Float[Array, "waypoint *rest"], Float[Array, "pair *rest"]]:
    """What samples add to the blocks of the waypoints between the ends, and to those of their neighbouring pairs."""
    inner = (samples.shape[0] - 1) // 2
    at, middle = samples[:inner], samples[inner:] / 4
    return at + middle[:-1] + middle[1:], middle[1:-1]


def _no_longer(move: Float[Array, "waypoint 3"], longest: Scalar) -> Float[Array, "waypoint 3"]:
    """The move, scaled down so that no waypoint moves farther than the longest allowed."""
    squared = jnp.max(jnp.sum(move * move, axis=-1))
    longest = jnp.asarray(longest, move.dtype)
    far = squared > longest * longest
    return move * jnp.where(far, longest / jnp.sqrt(jnp.where(far, squared, 1)), 1)


def _obstacle_push(planes: HalfSpaces, spare: Float[Array, "obstacle sample"], count: int, stiff: _Stiffness) -> _Push:
    """Of the obstacles, on the waypoints and midway between them: how far they are kept, on `count` segments."""
    normal = planes.normal
    push, held = push_back(spare, *stiff)
    block = [[jnp.sum(held * normal[i] * normal[j], axis=0) for j in range(3)] for i in range(3)]
    pushes = jnp.stack([jnp.sum(push * normal[i], axis=0) for i in range(3)], axis=-1)
    force = pushes[: count - 1] + (pushes[count - 1 : -1] + pushes[count:]) / 2
    return _Push(force, *_spread(jnp.stack([jnp.stack(row, axis=-1) for row in block], axis=-2)))


def _bounds_push(
    task: _Task, x: Float[Array, "waypoint 3"], total: Array, stiff: _Stiffness
) -> tuple[Float[Array, "inner 3"], Float[Array, "inner 3"], Float[Array, "inner 3"]]:
    """Of the bounds, on the waypoints between the ends: the pushes up and down, and how stiff they are on each axis."""
    face, inner, at = jnp.zeros(3, x.dtype), x[1:-1], task.place[: x.shape[0] - 2]
    start, goal, lower, upper = task.waypoints[0], task.waypoints[-1], task.lower, task.upper

    def allowed(at_start: Vector3, at_goal: Vector3) -> Float[Array, "inner 3"]:
        return attainable_gap(face, at_start, at_goal, task.path.opening, total, at).T

    up, held_up = push_back(inner - lower - allowed(start - lower, goal - lower), *stiff)
    down, held_down = push_back(upper - inner - allowed(upper - start, upper - goal), *stiff)
    return up, down, held_up + held_down


def _not_through(
    planes: HalfSpaces, spare: Float[Array, "obstacle sample"], step: Float[Array, "waypoint 3"], softness: Array
) -> Float[Array, "waypoint 3"]:
    """The step of all waypoints, scaled down so that no sample goes far into a half-space.

    Newton's matrix hardly feels an obstacle that is kept by more than the softness. Without this the path runs through it, is
    pushed back by the next step, and so to and fro.
    """
    nearer = -jnp.sum(planes.normal * _samples(step).T[:, None, :], axis=0)
    room = jnp.maximum(spare, 0) + _INTO * softness
    far = nearer > room
    return step * jnp.min(jnp.where(far, room / jnp.where(far, nearer, 1), 1), initial=1.0)


def _newton_step(
    task: _Task, planes: HalfSpaces, x: Float[Array, "waypoint 3"], softness: Float[Array, ""]
) -> Float[Array, "waypoint 3"]:
    """The path after one step of Newton's method on objective and penalties."""
    path, count = task.path, x.shape[0] - 1
    total, energy, length_gradient, energy_gradient = length_and_bending(x)
    a = path.omega1 * count / total
    b = 2 * path.omega2 * count**3 / total**3
    unit = (path.omega1 * _WAVE / total + 2 * path.omega2 * _WAVE * _WAVE / total**3) / count
    stiff = _Stiffness(path.penalty * unit, unit, softness)

    allowed = attainable_gap(task.required, task.at_start, task.at_goal, path.opening, total, task.place)
    spare = planes.gap(_samples(x)) - allowed
    push, diagonal, off = _obstacle_push(planes, spare, count, stiff)
    up, down, held = _bounds_push(task, x, total, stiff)
    diagonal = diagonal + held[:, :, None] * jnp.eye(3, dtype=x.dtype)

    lengthening = jnp.clip((_LONG[1] - total / task.guess_length) / (_LONG[1] - _LONG[0]), 0, 1)
    force = push + up - down - path.omega2 * energy_gradient
    force = force - (path.omega1 - 3 * path.omega2 * energy / total * lengthening) * length_gradient
    step = band_solve(*with_bands(diagonal, off, a, b), b, force)
    step = jnp.pad(_no_longer(step, path.move_max), ((1, 1), (0, 0)))
    return x + _not_through(planes, spare, step, softness)


def _softness(path: PathParams, iterations: int, dtype: jnp.dtype) -> Float[Array, "iteration move"]:
    """Reach of the penalties' push: from the first to the last one, in equal ratios, constant for the last fifth [m]."""
    first, last = jnp.asarray(path.softness_first, dtype), jnp.asarray(path.softness_last, dtype)
    ramp = jnp.minimum(jnp.linspace(0, 1.25, iterations * _MOVES, dtype=dtype), 1)
    return (first * (last / first) ** ramp).reshape(iterations, _MOVES)


def optimise_path(
    params: PlanParams,
    waypoints: Float[Array, "waypoint 3"],
    distances: DistancesFn,
    radius: Float[Array, "obstacle"],
    lower: Vector3,
    upper: Vector3,
    iterations: int,
    reached: Bool[Array, ""] | None = None,
) -> PathResult:
    """The path near the given one that minimises omega1 length + omega2 bending energy (eq. 5a) and keeps its
    distances.

    Newton's method on the objective with a smooth penalty that stiffens towards the constraints: one band matrix a
    step, and no step through an obstacle. An obstacle is a half-space through its nearest point, which is on the safe side of a convex one. The
    distances are asked for at the waypoints and midway between them. Which side of an obstacle the path takes is that
    of the given path, smoothed. If the distances cannot be kept the path tends to the least violation, and the status tells it.
    Differentiable by unrolling.

    Args:
        waypoints: equally spaced first guess; its ends stay [m].
        distances: signed distances to the surfaces of convex obstacles [m].
        radius: radius of each obstacle; its centre must stay zeta radii away [m].
        lower: lower bounds of the path; -inf is none [m].
        upper: upper bounds of the path; inf is none [m].
        iterations: number of iterations.
        reached: status to pass on; true if not given.

    Not finite if: omega1 and omega2 are both 0, or start and goal coincide.

    Raises:
        ValueError: fewer than 4 waypoints, or negative iterations.
    """
    require_floating("optimise_path", waypoints=waypoints)
    if waypoints.shape[0] < 4 or iterations < 0:
        raise ValueError(
            f"{waypoints.shape[0]} waypoints, {iterations} iterations; accepted are at least 4 waypoints, 0 iterations"
        )
    guess = _smooth(waypoints)
    task = _Task(
        path=params.path,
        waypoints=waypoints,
        required=required_distance(params, radius),
        at_start=distances(waypoints[0]),
        at_goal=distances(waypoints[-1]),
        lower=lower,
        upper=upper,
        guess_length=length(guess),
        place=_places(waypoints.shape[0] - 1, waypoints.dtype),
    )

    def iterate(
        x: Float[Array, "waypoint 3"], softness: Float[Array, "move"]
    ) -> tuple[Float[Array, "waypoint 3"], None]:
        planes = half_spaces(distances, _samples(x))
        return jax.lax.scan(lambda x, soft: (_newton_step(task, planes, x, soft), None), x, softness)[0], None

    result, _ = jax.lax.scan(jax.checkpoint(iterate), guess, _softness(params.path, iterations, waypoints.dtype))
    return judge(params, equally_spaced(result), distances, radius, lower, upper, reached)
