"""The least change of a joint command by which no point of the arm approaches a surface faster than it may.

With a row a_k = -g_k^T J_k for every control point and surface near it, a_k . qd is the speed of approach, and

    min |qd' - qd|^2 / 2   such that   a_k . qd' <= limit_k for all k

is a quadratic program of six unknowns; a retreat that is asked for and may be given up adds one. Its dual,
min y^T (A A^T) y / 2 - y^T (A qd - limit) over y >= 0, is solved by an
active-set method (Lawson and Hanson, Solving Least Squares Problems, ch. 23) with few rows at a time: scalars written out,
which `vmap` turns into vectors. Where it is at rest, no row is active and the command passes unchanged.
"""

import jax
import jax.numpy as jnp
from jax.ad_checkpoint import checkpoint_name

from hrcjax.numerics import CHOICE, ldl_factor, ldl_solve, safe_norm, solve_spd
from hrcjax.typing import Array, Bool, Float, Int

APPROACH_TOLERANCE = 0.002
"""An approach may be over its limit by so much [m/s]: S_p of ISO/TS 15066 grows by 0.002 (T_r + (v_h + v_r) / a), 2.2 mm at
v_h = 2 m/s, v_r = 1 m/s, T_r = 0.1 s and a = 3 m/s^2."""
EFFORT = 1.5
"""Change of the joint speeds, together, that a whole retreat is worth [rad/s]."""
UNLIMITED = 1e3
"""A limit from which on a row is none [m/s]."""


def least_change(
    qd: Float[Array, "joint"], A: Float[Array, "row joint"], limit: Float[Array, "row"], iterations: int = 24
) -> Float[Array, "joint"]:
    """The joint speeds nearest to the ones asked for with A . qd' <= limit, within APPROACH_TOLERANCE [rad/s].

    Bit for bit those asked for where they keep all limits. Limits below 0 ask for a retreat, as far as the others allow it and it
    is worth its effort: each counts (1 - s) limit, with one s in [0, 1] for all and

        min |qd' - qd|^2 + EFFORT^2 s^2.

    With s = 1 they count as 0; so a row that hardly moves its point must not ask for much. A last scaling holds every limit
    of 0 or more, whatever the iterations have reached: there is always a way, standing still, and a retreat from all surfaces passes. A row of zeros limits nothing. Differentiable, but where
    a row begins to count.

    Args:
        qd: joint speeds asked for [rad/s].
        A: speed of approach of every point to every surface near it, by the joint speeds [m].
        limit: its largest value; infinite: none [m/s]. Below 0 a retreat is asked for.
        iterations: of the active set, each of which takes in or leaves out one row.

    Returns:
        0 where A or a limit is not a number: nobody knows what they allow.
    """
    known = jnp.all(jnp.isfinite(A)) & ~jnp.any(jnp.isnan(limit)) & jnp.all(jnp.isfinite(qd))
    A, qd = jnp.where(known, A, 0.0), jnp.where(known, qd, 0.0)
    limit = jnp.clip(jnp.where(known, limit, 0.0), -UNLIMITED, UNLIMITED)
    limit = jnp.where(jnp.any(A != 0, axis=1), limit, 0.0)
    # one more unknown, EFFORT s
    count = qd.shape[0]
    yielding = jnp.append(jnp.minimum(limit, 0.0) / EFFORT, 1.0)
    rows = jnp.concatenate([A, jnp.zeros((1, count), A.dtype)])
    rows = jnp.concatenate([rows, yielding[:, None]], axis=1)
    chosen = _projected(jnp.append(qd, 0.0), rows, jnp.append(limit, EFFORT), iterations)[:count]
    chosen = jnp.where(jnp.all(_along(A, qd) <= limit), qd, chosen)
    approach = _along(A, chosen)
    least = jnp.maximum(limit, 0.0)
    most = least + APPROACH_TOLERANCE
    over = approach > most
    within = least + 0.99 * APPROACH_TOLERANCE  # room for rounding
    scale = jnp.min(jnp.where(over, within / jnp.where(over, approach, 1.0), 1.0))
    return jnp.where(known & jnp.all(jnp.isfinite(chosen)), scale * chosen, 0.0)


def _along(A: Float[Array, "row joint"], x: Float[Array, "joint"]) -> Float[Array, "row"]:
    """A x, joint by joint."""
    columns = jax.lax.split(A, (1,) * A.shape[1], axis=1)
    total = columns[0] * x[0]
    for j in range(1, A.shape[1]):
        total = total + columns[j] * x[j]
    return total[:, 0]


def _projected(
    qd: Float[Array, "joint"], A: Float[Array, "row joint"], limit: Float[Array, "row"], iterations: int
) -> Float[Array, "joint"]:
    """The nearest point to qd of the polytope A x <= limit."""
    size = safe_norm(A)
    some = size > 1e-6  # slower than a micrometre a second at 1 rad/s
    N = jnp.where(some[:, None], A / jnp.where(some, size, 1.0)[:, None], 0.0)
    c = jnp.where(some, limit / jnp.where(some, size, 1.0), UNLIMITED)
    still, around, limits = jax.lax.stop_gradient((qd, N, c))
    rows, used = (checkpoint_name(found, CHOICE) for found in _active(still, around, limits, iterations))
    n = jnp.where(used[:, None], N[rows], 0.0)
    softness = _softness(qd.dtype)
    G = jnp.sum(n[:, None, :] * n[None, :, :], axis=-1) + jnp.diag(jnp.where(used, softness, 1.0).astype(qd.dtype))
    for _ in range(2):  # the second time for what is soft
        over = jnp.where(used, jnp.sum(n * qd, axis=-1) - c[rows], 0.0)
        qd = qd - jnp.sum(n * solve_spd(G, over)[:, None], axis=0)
    return qd


def _softness(dtype: jnp.dtype) -> float:
    """What is added to the diagonal of the dual, so that rows may depend on each other [1]."""
    return float(jnp.finfo(dtype).eps) ** (2 / 3)


def _active(
    qd: Float[Array, "joint"], N: Float[Array, "row joint"], c: Float[Array, "row"], iterations: int
) -> tuple[Int[Array, "slot"], Bool[Array, "slot"]]:
    """The rows that hold qd at its nearest point, for rows N of length 1."""
    joints, dtype = qd.shape[0], qd.dtype
    slots = joints + 1  # more than can be independent, so that one may take the place of another
    softness = _softness(dtype)
    tolerance = 4 * softness
    table = jnp.concatenate([N, c[:, None]], axis=1)
    start = [qd[j] for j in range(joints)]

    columns, numbers = N.T, jnp.arange(N.shape[0], dtype=jnp.int32)  # vectors over the rows: half the time

    def most_violated(x: list[Array]) -> tuple[Array, Array]:
        over = -c
        for column, one in zip(columns, x, strict=True):
            over = over + column * one
        worst = jnp.max(over)
        return worst, jnp.min(jnp.where(over >= worst, numbers, N.shape[0] - 1))  # a sixth of the time of argmax

    def step(state):
        count, entry, rows, y, worst, k = state
        # take in the most violated row, where the others have settled
        free = rows < 0
        first = free & (jnp.cumsum(free) == 1) & (k >= 0)
        rows = jnp.where(first, k, rows)
        entry = jnp.where(first[:, None], table[jnp.maximum(k, 0)], entry)
        y = jnp.where(first, 0.0, y)
        used = rows >= 0
        n = [[jnp.where(used[s], entry[s, j], 0.0) for j in range(joints)] for s in range(slots)]
        G = [
            [sum((n[s][j] * n[t][j] for j in range(1, joints)), n[s][0] * n[t][0]) for t in range(s + 1)]
            for s in range(slots)
        ]
        for s in range(slots):
            G[s][s] = G[s][s] + jnp.where(used[s], softness, 1.0).astype(dtype)
        over = [
            jnp.where(
                used[s], sum((n[s][j] * start[j] for j in range(1, joints)), n[s][0] * start[0]) - entry[s, joints], 0.0
            )
            for s in range(slots)
        ]
        wanted = jnp.stack(ldl_solve(*ldl_factor(G), over))
        blocked = used & (wanted <= 0)
        share = jnp.where(blocked, y / jnp.where(blocked, y - wanted, 1.0), 1.0)
        share = jnp.where(blocked & (y <= 0), 0.0, share)
        way = jnp.minimum(jnp.min(share), 1.0)
        y = y + way * (wanted - y)
        dropped = blocked & (share <= way)
        rows = jnp.where(dropped, -1, rows)
        y = jnp.where(dropped | (rows < 0), 0.0, y)
        settled = ~jnp.any(blocked)
        x = [start[j] - sum((n[s][j] * y[s] for s in range(1, slots)), n[0][j] * y[0]) for j in range(joints)]
        worst, k = most_violated(x)
        room = jnp.any(rows < 0)
        worst = jnp.where(settled, jnp.where(room, worst, 0.0), jnp.inf)
        k = jnp.where(settled, k, -1)
        return count + 1, entry, rows, y, worst, k

    def going(state) -> Array:
        return (state[0] < iterations) & (state[4] > tolerance)

    worst, k = most_violated(start)
    entry = jnp.zeros((slots, joints + 1), dtype)
    state = (jnp.asarray(0), entry, jnp.full(slots, -1, jnp.int32), jnp.zeros(slots, dtype), worst, k)
    _, _, rows, y, _, _ = jax.lax.while_loop(going, step, state)
    return jnp.maximum(rows, 0), (rows >= 0) & (y > 0)
