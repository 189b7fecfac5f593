"""Shortest and straightest path that keeps its distance: minimise omega1 length + omega2 bending energy."""

import math

import jax
import jax.numpy as jnp
import numpy as np

from hrcjax.numerics import safe_sqrt
from hrcjax.plan.band import band_solve
from hrcjax.plan.curve import equally_spaced
from hrcjax.plan.length import length
from hrcjax.plan.params import PlanParams
from hrcjax.plan.path_result import PathResult, judge, required_distance
from hrcjax.plan.potential import DistancesFn
from hrcjax.typing import Array, Bool, Float, Scalar, Vector3

_WAVE = (4 * math.pi) ** 2
"""Square of the wave number, times the length of the path, at which constraint and path are compared."""
_MOVES = 2
"""Newton steps for each look at the obstacles."""
_FAR = 10.0
"""Distance beyond which a constraint is as good as absent: keeps infinite bounds out of the derivatives [m]."""
_SMOOTHING = 16.0
"""Weight of the squared second differences in smoothing the guess: waves shorter than 13 segments are damped."""
_LONG = (1.25, 1.5)
"""Lengths, over that of the guess, between which bending stops to lengthen the path. A bent path of twice the size
has half the bending energy, so that without this a path caught between obstacles grows without end."""


def _curve_energy(waypoints: Float[Array, "waypoint 3"]) -> tuple[Array, Array, Array, Array]:
    """Length, bending energy, and at the waypoints between the ends their gradients (the second at constant length).

    For equal steps. The length is sqrt(N sum |step|^2), above the true one unless the steps are equal: so the minimum
    has equal steps. The bending energy is N^3 sum |bend|^2 / length^3.
    """
    count = waypoints.shape[0] - 1
    steps = jnp.diff(waypoints, axis=0)
    bends = jnp.diff(steps, axis=0)
    total = safe_sqrt(count * jnp.sum(steps * steps))
    scale = count**3 / total**3
    fourth = jnp.diff(jnp.pad(bends, ((1, 1), (0, 0))), n=2, axis=0)
    return total, scale * jnp.sum(bends * bends), -count / total * bends, 2 * scale * fourth


def _smooth(waypoints: Float[Array, "waypoint 3"]) -> Float[Array, "waypoint 3"]:
    """The path x with the least |x - waypoints|^2 + _SMOOTHING |second differences of x|^2 and the same ends."""
    count = waypoints.shape[0]
    differences = np.eye(count - 2, count) - 2 * np.eye(count - 2, count, k=1) + np.eye(count - 2, count, k=2)
    fourth = _SMOOTHING * (differences.T @ differences)[1:-1]
    move = np.linalg.solve(np.eye(count - 2) + fourth[:, 1:-1], -fourth)
    return waypoints.at[1:-1].add(jnp.asarray(move, waypoints.dtype) @ waypoints)


def _bands(
    diagonal: Float[Array, "waypoint 3 3"], off: Float[Array, "pair 3 3"], a: Scalar, b: Scalar
) -> tuple[Float[Array, "waypoint 3 3"], Float[Array, "pair 3 3"]]:
    """The blocks with those of a |differences|^2 / 2 + b |second differences|^2 / 2 added."""
    eye = jnp.eye(3, dtype=diagonal.dtype)
    edge = jnp.zeros(diagonal.shape[0], diagonal.dtype).at[0].add(1).at[-1].add(1)[:, None, None]
    return diagonal + (2 * a + (6 - edge) * b) * eye, off - (a + 4 * b) * eye


def _samples(waypoints: Float[Array, "waypoint 3"]) -> Float[Array, "sample 3"]:
    """The waypoints between start and goal, then the middles of all segments."""
    return jnp.concatenate([waypoints[1:-1], (waypoints[:-1] + waypoints[1:]) / 2])


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
    step. An obstacle is a half-space through its nearest point, which is on the safe side of a convex one. The
    distances are asked for at the waypoints and midway between them. Which side of an obstacle the path takes is that
    of the given path, smoothed. If the distances cannot be kept the path tends to the least violation, and says so.
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
    if waypoints.shape[0] < 4 or iterations < 0:
        raise ValueError(
            f"{waypoints.shape[0]} waypoints, {iterations} iterations; accepted are at least 4 waypoints, 0 iterations"
        )
    path = params.path
    dtype = waypoints.dtype
    count = waypoints.shape[0] - 1
    place = jnp.concatenate([jnp.arange(1, count, dtype=dtype), jnp.arange(count, dtype=dtype) + 0.5]) / count

    def gaps_and_normals(x: Vector3) -> tuple[Float[Array, "obstacle"], Float[Array, "3 obstacle"]]:
        return jax.vmap(lambda e: jax.jvp(distances, (x,), (e,)), out_axes=(None, 0))(jnp.eye(3, dtype=dtype))

    def allowed(
        least: Float[Array, "*k"], start: Float[Array, "*k"], goal: Float[Array, "*k"], total: Array, place: Array
    ) -> Float[Array, "*k sample"]:
        """The least gap, or what can be attained by opening from a smaller one at start or goal."""
        opening = path.opening * total * place
        rising, falling = start[..., None] + opening, goal[..., None] + path.opening * total - opening
        return jnp.minimum(least[..., None], jnp.minimum(rising, falling))

    required = required_distance(params, radius)
    at_start, at_goal = distances(waypoints[0]), distances(waypoints[-1])
    face = jnp.zeros(3, dtype)
    guess = _smooth(waypoints)
    guess_length = length(guess)

    def iterate(
        x: Float[Array, "waypoint 3"], softness: Float[Array, "move"]
    ) -> tuple[Float[Array, "waypoint 3"], None]:
        # sample is the last axis, so that sums over obstacles run over whole vectors
        samples = _samples(x)
        gap, normal = jax.vmap(gaps_and_normals, out_axes=(1, 2))(samples)
        offset = gap - jnp.sum(normal * samples.T[:, None, :], axis=0)

        def move(x: Float[Array, "waypoint 3"], softness: Float[Array, ""]) -> tuple[Float[Array, "waypoint 3"], None]:
            total, energy, length_gradient, energy_gradient = _curve_energy(x)
            a = path.omega1 * count / total
            b = 2 * path.omega2 * count**3 / total**3
            unit = (path.omega1 * _WAVE / total + 2 * path.omega2 * _WAVE * _WAVE / total**3) / count
            stiffness = path.penalty * unit

            def push_back(spare: Array) -> tuple[Array, Array]:
                """The push > 0 with push = stiffness (excess - spare), push excess = unit softness^2; its stiffness."""
                spare = jnp.minimum(spare, _FAR)
                root = jnp.sqrt((stiffness * spare) ** 2 + 4 * stiffness * unit * softness * softness)
                larger = (root + jnp.abs(stiffness * spare)) / 2
                push = jnp.where(spare > 0, stiffness * unit * softness * softness / larger, larger)
                return push, stiffness * push / root

            gap = offset + jnp.sum(normal * _samples(x).T[:, None, :], axis=0)
            push, held = push_back(gap - allowed(required, at_start, at_goal, total, place))
            block = [[jnp.sum(held * normal[i] * normal[j], axis=0) for j in range(3)] for i in range(3)]
            pushes = jnp.stack([jnp.sum(push * normal[i], axis=0) for i in range(3)], axis=-1)
            force = pushes[: count - 1] + (pushes[count - 1 : -1] + pushes[count:]) / 2
            diagonal, off = _spread(jnp.stack([jnp.stack(row, axis=-1) for row in block], axis=-2))

            inner, start, goal, at = x[1:-1], waypoints[0], waypoints[-1], place[: count - 1]
            up, held_up = push_back(inner - lower - allowed(face, start - lower, goal - lower, total, at).T)
            down, held_down = push_back(upper - inner - allowed(face, upper - start, upper - goal, total, at).T)
            diagonal = diagonal + (held_up + held_down)[:, :, None] * jnp.eye(3, dtype=dtype)

            lengthening = jnp.clip((_LONG[1] - total / guess_length) / (_LONG[1] - _LONG[0]), 0, 1)
            force = force + up - down - path.omega2 * energy_gradient
            force = force - (path.omega1 - 3 * path.omega2 * energy / total * lengthening) * length_gradient
            step = band_solve(*_bands(diagonal, off, a, b), b, force)
            return x + jnp.pad(_no_longer(step, path.move_max), ((1, 1), (0, 0))), None

        return jax.lax.scan(move, x, softness)[0], None

    first, last = jnp.asarray(path.softness_first, dtype), jnp.asarray(path.softness_last, dtype)
    ramp = jnp.minimum(jnp.linspace(0, 1.25, iterations * _MOVES, dtype=dtype), 1)
    softness = (first * (last / first) ** ramp).reshape(iterations, _MOVES)
    result, _ = jax.lax.scan(jax.checkpoint(iterate), guess, softness)
    return judge(params, equally_spaced(result), distances, radius, lower, upper, reached)
