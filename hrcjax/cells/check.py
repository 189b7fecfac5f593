"""Faults of a cell that can be told before a world is built: leaves that are no numbers, parts that return something else."""

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from hrcjax.cells.named_cell import NamedCell
from hrcjax.cells.results import TRACES
from hrcjax.cells.worlds import DESCRIBED
from hrcjax.geom.point_motion import PointMotion
from hrcjax.lab.errors import UsageError
from hrcjax.lab.parameters import leaf_names, path_name
from hrcjax.metrics import METRICS
from hrcjax.plan import PathResult
from hrcjax.policy import JointLimits
from hrcjax.safety import ContactMobility, SafetyDecision
from hrcjax.sim import ArmMotion, Clearance, Goal, Separation, Task
from hrcjax.sweeps.sweepable import Metric
from hrcjax.world import scene_named

TAKEN = {
    *METRICS,
    *TRACES,
    *DESCRIBED,
    "status",
    "scene",
    "person",
    "seed",
    "setting",
    "sample",
    "time",
    "frame",
    "xyz",
}
"""Names of results that a metric must not have."""


def check_cell(named: NamedCell) -> None:
    """Raises UsageError, one line, for a parameter that is not a float or a float array, an alias or domain of no
    parameter, a metric that is no (Metric, function), or a planner, policy or monitor whose result has another type or shape.

    What a part itself raises goes through: it names the line.
    """
    _check_leaves(named)
    known = leaf_names(named.params)
    for what, names in (("domains", named.domains), ("aliases", named.aliases.values())):
        unknown = [name for name in names if name not in known]
        if unknown:
            raise UsageError(f"{what} of the cell: no parameter {unknown[0]!r}; accepted: {', '.join(known)}")
    for name, entry in named.metrics.items():
        if name in TAKEN:
            raise UsageError(f"metric {name!r}: results have this name already; accepted: another name")
        if not (isinstance(entry, tuple) and len(entry) == 2 and isinstance(entry[0], Metric) and callable(entry[1])):
            raise UsageError(f'metric {name!r}: accepted is (Metric("m", "low", "what it is"), function)')
    _check_results(named)


def _check_leaves(named: NamedCell) -> None:
    leaves, _ = jax.tree_util.tree_flatten_with_path(named.params)
    names = [path_name(path) for path, _ in leaves]
    twice = [name for name in names if names.count(name) > 1]
    if twice:
        raise UsageError(f"parameter {twice[0]}: two leaves have this name; accepted: keys without dots")
    for path, leaf in leaves:
        number = isinstance(leaf, int | float | np.ndarray | np.number | jax.Array) and not isinstance(leaf, bool)
        kind = np.asarray(leaf).dtype.kind if number else ""
        if kind not in ("f", "i", "u"):
            raise UsageError(
                f"parameter {path_name(path)} is a {type(leaf).__name__}; accepted: a float or an array of floats. "
                "Switches, sizes and texts: eqx.field(static=True)"
            )


def _check_results(named: NamedCell) -> None:
    """Traces planner, policy and monitor on shapes alone."""
    cell, arm = named.cell, named.cell.arm
    joints, points = arm.chain.size, len(arm.control_links)
    params = jax.tree.map(lambda leaf: jnp.asarray(leaf, jnp.float32), named.params)
    scene, q = scene_named("robotica", 0), jnp.zeros(joints, jnp.float32)

    def zeros(*shape: int) -> Any:
        return jnp.zeros(shape, jnp.float32)

    def motion(count: int) -> PointMotion:
        return PointMotion(zeros(count, 3), zeros(count, 3), zeros(count, 3, joints), zeros(count, 3))

    path = jax.eval_shape(cell.plan, params.plan, Task(scene, q, params.potential, arm))
    _expect("planner", path, PathResult, "path_through(task, waypoints) makes one")
    _shape("planner: waypoints", path.waypoints, lambda shape: len(shape) == 2 and shape[1] == 3, "(waypoint, 3)")
    body = ArmMotion(q, q, motion(3), motion(points))
    goal = Goal(zeros(3, 3), zeros(3, 3), zeros(3, 3), q, zeros(3), params.potential)
    room = Clearance(zeros(points), zeros(points, 3), zeros(points), zeros(points, 3), zeros(points), zeros(points, 3))
    qdd = jax.eval_shape(cell.policy, params.policy, body, goal, room, JointLimits(q, q, q, q))
    _shape("policy", qdd, lambda shape: shape == (joints,), f"({joints},), an acceleration of each joint")
    memory = jax.eval_shape(lambda: cell.safety.start(jnp.dtype("float32")))
    rows, felt = zeros(points, joints), None
    if cell.contact_mass == "reflected":
        felt = ContactMobility(zeros(joints, joints), zeros(3, joints), rows, rows, rows, jnp.ones(points, bool))
    separation = Separation(
        zeros(points), zeros(points), zeros(), jnp.asarray(True), jnp.asarray(False), cell.dt, felt, zeros(points)
    )
    answer = jax.eval_shape(lambda p, m: cell.safety.decide(p, m, separation), params.safety, memory)
    if not (isinstance(answer, tuple) and len(answer) == 2):
        raise UsageError(f"monitor: returns {type(answer).__name__}; accepted: (memory, SafetyDecision)")
    after, decision = answer
    _expect("monitor", decision, SafetyDecision, "with all of its fields")
    _shape("monitor: point_limit", decision.point_limit, lambda shape: shape == (points,), f"({points},)")
    for name in ("zone", "speed_limit", "hold", "reasons"):
        _shape(f"monitor: {name}", getattr(decision, name), lambda shape: shape == (), "one value")
    if jax.tree.map(lambda a: (a.shape, a.dtype), after) != jax.tree.map(lambda a: (a.shape, a.dtype), memory):
        raise UsageError("monitor: the memory after a tick differs from that of start() in structure, shape or dtype")


def _expect(part: str, found: Any, kind: type, remedy: str) -> None:
    if not isinstance(found, kind):
        raise UsageError(f"{part}: returns {_words(found)}; accepted: a {kind.__name__}, {remedy}")


def _shape(part: str, found: Any, right: Callable[[tuple[int, ...]], bool], accepted: str) -> None:
    shape = getattr(found, "shape", None)
    if shape is None or not right(tuple(shape)):
        raise UsageError(f"{part}: returns {_words(found)}; accepted: {accepted}")


def _words(found: Any) -> str:
    shape = getattr(found, "shape", None)
    return type(found).__name__ if shape is None else f"an array of shape {tuple(shape)}"
