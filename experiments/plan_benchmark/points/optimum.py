"""The optimiser's paths against the least cost that an augmented Lagrangian finds, in scenes whose constraints bind hard."""

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from hrcjax.plan import PathParams, PlanParams, PlanSizes, plan, plan_multi_start
from hrcjax.plan.plan import arch
from hrcjax.plan.point_guesses import detour_guesses, detours
from hrcjax.typing import Array, Float
from hrcjax.world import Scene, obstacle_distances

from .curve import TOLERANCE, Curve
from .lagrange import FIRST_PENALTY, Minimum, Problem, minimum
from .ours import STARTS
from .scenes import PointScene, draw_scene, way_exists

RADIUS, ZETA = 0.03, 4.0
"""Radius of every obstacle [m], and how many of them its centre must stay away."""
REQUIRED = (ZETA - 1) * RADIUS
"""Surface distance asked for: three times that of the comparison [m]."""
COMPARED = ("multi_start", "iapf_optimised")
"""Planners of the comparison that minimise this cost."""
SIZES = PlanSizes()
OTHER_SEED = 7
"""Of the detours that the augmented Lagrangian starts from: other ones than the planner's."""
GUESSES = 18
"""Its starts besides the planners' paths."""
STIFF = 3000.0
"""First penalty where the path shall hardly slip to another side: some tens of micrometres of violation [1/m^2]."""
SAME = 1e-5
"""Difference of the distances kept that does not count [m]."""
MORE = 1e-3
"""Most by which the distance asked for is lowered at once, as it may not bind at all [m]."""
FAR = 5.0
"""Distance beyond which a constraint is as good as absent [m]."""


class Checked(NamedTuple):
    """A path by the dense check: the natural spline through its waypoints, points every mm, exact distances in NumPy."""

    cost: float
    """omega1 length + omega2 bending energy of the spline [1]."""
    violation: float
    """What is missing from the distance asked for; negative: kept by more [m]."""
    outside: float
    """How far the spline leaves the bounds; negative: how far it stays within [m]."""


def hard_scenes(count: int) -> dict[int, PointScene]:
    """The first scenes by seed whose ends and at least one way keep the distance asked for."""
    found: dict[int, PointScene] = {}
    seed = 0
    while len(found) < count:
        scene = draw_scene(seed)
        if scene is not None:
            ends = scene.distances(np.stack([scene.start, scene.goal])).min()
            if ends >= REQUIRED and way_exists(scene, REQUIRED):
                found[seed] = scene
        seed += 1
    return found


def checked(scene: PointScene, waypoints: NDArray) -> Checked:
    """The dense check of a path, whoever made it."""
    curve, weights = Curve(waypoints), PathParams()
    points = curve.sampled()
    return Checked(
        weights.omega1 * curve.length() + weights.omega2 * curve.bending_energy(),
        REQUIRED - float(scene.distances(points).min()),
        float(max((scene.lower - points).max(), (points - scene.upper).max())),
    )


@jax.jit
def _planned(scene: Scene) -> dict[str, tuple[Array, Array]]:
    """Waypoints of each planner, and whether it claims to keep distances and bounds."""
    params = eqx.tree_at(lambda p: p.potential.zeta, PlanParams(), ZETA)
    params = jax.tree.map(partial(jnp.asarray, dtype=scene.start.dtype), params)
    asked = (
        params, scene.start, scene.goal, lambda x: obstacle_distances(scene, x), scene.radius, scene.lower, scene.upper, SIZES,
    )  # fmt: skip
    found = dict(zip(COMPARED, (plan_multi_start(*asked, STARTS), plan(*asked)), strict=True))
    return {name: (path.waypoints, path.clear & path.inside) for name, path in found.items()}


def planned(scene: PointScene) -> dict[str, tuple[NDArray, bool]]:
    """The planners' waypoints in float32 as in the comparison, and what they claim."""
    found = jax.device_get(_planned(scene.for_library(RADIUS)))
    return {name: (_between(scene, points), bool(claimed)) for name, (points, claimed) in found.items()}


def _between(scene: PointScene, waypoints: Any) -> NDArray:
    """The waypoints in double precision, their ends exactly start and goal."""
    return np.concatenate([scene.start[None], np.asarray(waypoints, float)[1:-1], scene.goal[None]])


def path_cost(waypoints: Float[Array, "waypoint 3"]) -> Float[Array, ""]:
    """omega1 length + omega2 bending energy of equal steps; steps that are not equal cost more [1]."""
    steps = jnp.diff(waypoints, axis=0)
    bends, count, weights = jnp.diff(steps, axis=0), steps.shape[0], PathParams()
    length = jnp.sqrt(count * jnp.sum(steps * steps))
    return weights.omega1 * length + weights.omega2 * count**3 * jnp.sum(bends * bends) / length**3


def _spare(scene: Scene, required: Array, waypoints: Float[Array, "waypoint 3"]) -> Float[Array, "constraint"]:
    """How far each constraint is kept, at the planner's samples: every obstacle at the waypoints and midway between them, the
    bounds at the waypoints [m]."""
    inner = waypoints[1:-1]
    samples = jnp.concatenate([inner, (waypoints[:-1] + waypoints[1:]) / 2])
    gaps = jax.vmap(lambda x: obstacle_distances(scene, x))(samples) - required
    return jnp.concatenate([jnp.minimum(gaps, FAR).ravel(), (inner - scene.lower).ravel(), (scene.upper - inner).ravel()])  # fmt: skip


def _whole(scene: Scene, inner: Array) -> Float[Array, "waypoint 3"]:
    return jnp.concatenate([scene.start[None], inner.reshape(-1, 3), scene.goal[None]])


@jax.jit
def _constraints(scene: Scene, required: Array, inner: Array) -> Array:
    return _spare(scene, required, _whole(scene, inner))


@jax.jit
def _augmented(scene: Scene, required: Array, inner: Array, multipliers: Array, penalty: Array) -> tuple[Array, Array]:
    def value(inner: Array) -> Array:
        waypoints = _whole(scene, inner)
        missed = jnp.maximum(multipliers / penalty - _spare(scene, required, waypoints), 0)
        return path_cost(waypoints) + penalty / 2 * jnp.sum(missed * missed)

    return jax.value_and_grad(value)(inner)


def path_problem(scene: Scene, required: float, count: int, length: float) -> Problem:
    """The optimiser's problem, in the precision of the scene.

    Args:
        required: surface distance [m].
        count: number of waypoints.
        length: about that of the path [m].
    """
    needed = jnp.asarray(required, scene.start.dtype)
    first, second = (np.diff(np.eye(count), n=n, axis=0)[:, 1:-1] for n in (1, 2))
    weights, steps = PathParams(), count - 1
    stiff = (
        weights.omega1 * steps / length * first.T @ first
        + 2 * weights.omega2 * (steps / length) ** 3 * second.T @ second
    )

    def augmented(x: NDArray, multipliers: NDArray, penalty: float) -> tuple[float, NDArray]:
        value, slope = _augmented(scene, needed, x, multipliers, penalty)
        return float(value), np.asarray(slope)

    scale = np.kron(np.linalg.cholesky(np.linalg.inv(stiff)), np.eye(3))
    return Problem(augmented, lambda x: np.asarray(_constraints(scene, needed, x)), scale)


def _minimum(
    scene: PointScene, given: Scene, start: NDArray, required: float, penalty: float = FIRST_PENALTY
) -> tuple[NDArray, float]:
    """The waypoints to which a start leads, and the residual; infinite if rounds did not suffice."""
    length = float(np.linalg.norm(np.diff(start, axis=0), axis=1).sum())
    found: Minimum = minimum(path_problem(given, required, len(start), length), start[1:-1].ravel(), penalty)
    return _between(
        scene, np.concatenate([start[:1], found.x.reshape(-1, 3), start[-1:]])
    ), found.residual if found.converged else np.inf


def settled(scene: PointScene, given: Scene, start: NDArray, allowed: float) -> tuple[NDArray, float]:
    """The minimum near a start whose spline violates the distance by no more than allowed; waypoints and residual.

    Between the samples the spline may be nearer or farther by a tenth of a mm: that much more or less is asked for at them.
    """
    required, x, residual = REQUIRED - allowed, start, np.inf
    for _ in range(5):
        x, residual = _minimum(scene, given, start, required, STIFF)
        if not np.isfinite(residual):  # its line search may fail where many stiff constraints change at once
            x, residual = _minimum(scene, given, start, required)
        over = checked(scene, x).violation - allowed
        if abs(over) <= SAME:
            break
        required += max(over, -MORE)
    return x, residual


def starts(scene: PointScene, count: int) -> NDArray:
    """First guesses (guess waypoint 3): the arch over the obstacles, the straight line, bows all round it, detours [m]."""
    start, goal, lower, upper = (jnp.asarray(x) for x in (scene.start, scene.goal, scene.lower, scene.upper))
    aside = jnp.asarray(detours(count - 1, OTHER_SEED), start.dtype)
    return np.concatenate([
        np.asarray(arch(start, goal, upper, SIZES.waypoints))[None],
        np.asarray(detour_guesses(start, goal, lower, upper, aside, SIZES.waypoints)),
    ])  # fmt: skip


Paths = Mapping[str, tuple[NDArray, bool]]


def compared(
    scene: PointScene, planner: Callable[[PointScene], Paths] = planned, guesses: int = GUESSES
) -> dict[str, Any]:
    """Each planner's path in a scene, and the best that the augmented Lagrangian finds, as arrays over COMPARED.

    cost, violation, claimed: of the planner's path by the dense check. best_*: the least cost found from any start, keeping the
    distance in full. equal_*: the same, allowed the violation that the planner's path has. own_*: as equal_*, from the planner's path alone, or equal_* where
    that leads to no minimum.
    """
    ours = planner(scene)
    verdicts = {name: checked(scene, ours[name][0]) for name in COMPARED}
    with jax.enable_x64(True):
        given = scene.for_library(RADIUS, jnp.float64)
        tried = [ours[name][0] for name in COMPARED] + list(starts(scene, guesses))
        found = [_minimum(scene, given, start, REQUIRED) for start in tried]
        good = [x for x, residual in found if np.isfinite(residual)]
        if not good:
            return {"solved": False}
        near = min(good, key=lambda x: checked(scene, x).cost)
        best, residual = settled(scene, given, near, 0.0)
        out: dict[str, Any] = {"solved": np.isfinite(residual), "starts": len(tried), "converged": len(good)}
        out |= {"best_waypoints": best, "residual": residual, **_named("best", checked(scene, best))}
        each: dict[str, list[Any]] = {}
        for name in COMPARED:
            allowed = max(verdicts[name].violation, 0.0)
            own, own_residual = settled(scene, given, ours[name][0], allowed)
            equal, equal_residual = settled(scene, given, near, allowed) if allowed else (best, residual)
            own_checked, equal_checked = checked(scene, own), checked(scene, equal)
            if not np.isfinite(own_residual):
                own_checked = equal_checked
            elif own_checked.cost < equal_checked.cost:
                equal_checked, equal_residual = own_checked, own_residual
            said = {
                "claimed": ours[name][1], "waypoints": ours[name][0], "own_residual": own_residual, "equal_residual": equal_residual,
                **_named("", verdicts[name]), **_named("own", own_checked), **_named("equal", equal_checked),
            }  # fmt: skip
            for key, value in said.items():
                each.setdefault(key, []).append(value)
    return {**out, **{key: np.array(values) for key, values in each.items()}}


def _named(prefix: str, verdict: Checked) -> dict[str, float]:
    return {f"{prefix}_{key}" if prefix else key: value for key, value in verdict._asdict().items()}


def kept(violation: NDArray, outside: NDArray) -> NDArray:
    """Whether the dense check accepts a path, by the tolerance of the planner."""
    return (violation <= TOLERANCE) & (outside <= TOLERANCE)
