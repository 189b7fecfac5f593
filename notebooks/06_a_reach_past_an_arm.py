# ---
# jupyter:
#   jupytext:
#     text_representation:
#       extension: .py
#       format_name: percent
#   kernelspec:
#     display_name: Python 3
#     language: python
#     name: python3
# ---

# %% [markdown]
# # Fields and metrics of a reach past an arm
#
# A person reaches into the way of the UR5. What does the robot see of it, what do its policies ask for, and how much does each of
# them weigh? The field is made of noisy images of two depth cameras; the exact person is drawn, and measures, but is not read.

# %%
# %matplotlib inline
import time
from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
import matplotlib.pyplot as plt
import numpy as np
from IPython.display import display
from matplotlib.patches import Ellipse

from hrcjax.cells import ur5_cell
from hrcjax.cells.worlds import build_world
from hrcjax.numerics import unrolled_options
from hrcjax.policy.collision import collision
from hrcjax.policy.repulsion import repulsion
from hrcjax.policy.target import target
from hrcjax.sim import Fields, SafetyPart, episode, outcome
from hrcjax.sim.default_parts import PERSON_FADE
from hrcjax.viz import Obstacles, PathLine, PersonPoses, plan_view
from hrcjax.viz.field_slice import FieldSlice, draw_slice
from hrcjax.viz.path_view import capsule_outline
from hrcjax.world import person_at

begin = time.monotonic()
named = ur5_cell()
cell, params = replace(named.cell, ticks=1000), named.params
world = build_world(cell, "hri", "reach_in", 0)
fields = jax.jit(cell.field.fit)(params.field, world.frames)
print(f"a world of {cell.ticks * cell.dt:.0f} s, sensed and fitted after {time.monotonic() - begin:.0f} s")

# %% [markdown]
# ## Four episodes
#
# 1. The cell as it is: policies and safety layer.
# 2. The policies alone: a monitor that allows everything, so that whatever keeps the arm away from the person is a policy.
# 3. The same with the strongest repulsion of the default sweep, K_rep 1e-3 instead of 3e-5.
# 4. The same as 2 without what keeps off surfaces: `repulsion` and `collision` do not weigh anything.
#
# `watched` decides between the monitors inside one program, so that it is compiled once.


# %%
class Watched(eqx.Module):
    """The parameters of the monitor, and whether it is asked."""

    own: eqx.Module
    watched: jax.Array


def decide(p, memory, seen):
    memory, found = cell.safety.decide(p.own, memory, seen)
    free, none = jnp.full_like(found.point_limit, 100.0), jnp.zeros_like(found.zone)
    nothing = replace(
        found, zone=none, speed_limit=free[0], point_limit=free, hold=jnp.asarray(False), reasons=none, any_limit=free[0],
        aside=0.0 * free[0], gain=free[0],
    )  # fmt: skip
    return memory, jax.tree.map(lambda a, b: jnp.where(p.watched, a, b), found, nothing)


switched = replace(cell, safety=SafetyPart(cell.safety.start, decide, lambda p: cell.safety.yardstick(p.own)))
everything = eqx.tree_at(lambda p: p.safety, params, Watched(params.safety, jnp.asarray(True)))
policies = eqx.tree_at(lambda p: p.safety.watched, everything, jnp.asarray(False))
weights = lambda p: (p.policy.repulsion.weight, p.policy.collision.weight)  # noqa: E731  # where they are
strong = eqx.tree_at(lambda p: p.potential.k_rep, policies, 1e-3)
blind = eqx.tree_at(weights, policies, (0.0, 0.0))


def play(p):
    run = episode(p, switched, world, fields)
    return run, outcome(p, switched, world, run)


play = jax.jit(play, compiler_options=unrolled_options())
NAMES = ("policies and safety layer", "policies alone", "policies alone, K_rep 1e-3", "neither")
COLOURS = ("#1f5fa8", "#2a9d5c", "#7b4fb5", "#d0702e")
runs = [play(p) for p in (everything, policies, strong, blind)]
print(f"four episodes after {time.monotonic() - begin:.0f} s")
for name, (_, found) in zip(NAMES, runs, strict=True):
    m = found.metrics
    print(f"{name}: least distance {1e3 * float(m.separation):.0f} mm, arrives after {float(m.time_to_goal):.1f} s")

# %% [markdown]
# ## From above, and over time
#
# The person is drawn where it is when the arm with safety layer is nearest.

# %%
every = cell.metric_stride
times = np.asarray(cell.times)[::every]
nearest = int(np.argmin(runs[0][1].traces.separation_t))
t_near = float(times[nearest])
person = person_at(world.person, jnp.asarray(t_near, jnp.float32))
a, b, radius = (np.asarray(v) for v in (person.a, person.b, person.radius))
scene = world.scene
solids = Obstacles(*(np.asarray(v) for v in (scene.kind, scene.center, scene.size, scene.yaw, scene.mask)))
lines = [PathLine(np.asarray(run.record.tool), name, c) for (run, _), name, c in zip(runs, NAMES, COLOURS, strict=True)]
lines.append(
    PathLine(np.asarray(runs[0][0].path.waypoints), "plan, which knows nothing of people", "#888888", dashed=True)
)
pose = PersonPoses(a[None], b[None], radius, np.array([t_near]))
ends = {"start": np.asarray(scene.start), "goal": np.asarray(scene.goal)}
display(plan_view(lines, solids, pose, **ends, title=f"The tool from above; the person after {t_near:.1f} s")[0])

figure, (above, below) = plt.subplots(2, 1, figsize=(7.5, 5.2), sharex=True, layout="constrained")
for (_, found), name, colour in zip(runs, NAMES, COLOURS, strict=True):
    above.plot(times, found.traces.separation_t, color=colour, label=name)
    below.plot(times, found.traces.speed, color=colour)
above.axhline(0, color="black", lw=0.6)
above.set(ylabel="exact separation [m]")
below.set(ylabel="speed of the tool [m/s]", xlabel="time [s]")
above.legend(frameon=False, fontsize=8)
plt.show()

# %% [markdown]
# ## The field around the person
#
# At the height of the tool at that time. Left: the distance to everything, which policies read, with its gradient. Right: the lower
# bound of the distance to people, which the safety layer reads: less noise, spread of the points and space where somebody may be unseen.
# Orange: the exact person's capsules that reach this height.

# %%
tick_near = nearest * every
q_tool = np.asarray(runs[0][0].record.tool)[tick_near]
frame = int(np.searchsorted(np.asarray(world.frames.stamp), t_near - cell.latency, side="right") - 1)
now = Fields(fields.static, jax.tree.map(lambda v: v[frame], fields.moving))
height = float(q_tool[2])
right, up = q_tool[0] + np.linspace(-0.6, 0.6, 49), q_tool[1] + np.linspace(-0.6, 0.6, 49)
flat = np.stack(np.meshgrid(right, up, indexing="ij"), axis=-1).reshape(-1, 2)
places = jnp.asarray(np.insert(flat, 2, height, axis=1), jnp.float32)
seen = jax.jit(jax.vmap(lambda x: cell.field.read(params.field, now, x)))(places)


def reaching():
    """Outlines of the capsules that meet the plane."""
    for p, r, size in zip(a, b, radius, strict=True):
        if min(p[2], r[2]) - size < height < max(p[2], r[2]) + size:
            yield capsule_outline(p[:2], r[:2], size)


def finish(axes, title):
    for outline in reaching():
        axes.plot(*outline.T, color="#ff7f2a", lw=1.2)
    axes.plot(*q_tool[:2], "o", color="white", mec="black", ms=6)
    axes.set(title=title, xlabel="x [m]", ylabel="y [m]", aspect="equal", xlim=right[[0, -1]], ylim=up[[0, -1]])


figure, pair = plt.subplots(1, 2, figsize=(11, 5), layout="constrained")
some = np.arange(len(flat)).reshape(49, 49)[::4, ::4].ravel()
for axes, d, g, title in (
    (pair[0], seen.distance, seen.gradient, "distance to everything [m]"),
    (pair[1], seen.person_distance[:, 0], seen.person_gradient[:, 0], "lower bound to people [m]"),
):
    arrows = np.concatenate([flat[some], np.asarray(g)[some, :2]], axis=1)
    draw_slice(axes, FieldSlice(height, right, up, np.asarray(d).reshape(49, 49), arrows), 0.5)
    finish(axes, title)
plt.show()

# %% [markdown]
# ## What the leaves ask of a point, and how much they weigh
#
# A point that goes with the speed of the tool, placed anywhere on that plane; its goal is that of the task. A leaf asks for an acceleration (arrow) and
# weighs it with a metric (ellipse: its matrix applied to a circle, so a thin one weighs in one direction alone). All leaves
# together give the mean weighed by metrics: `(M1 + M2 + M3)^-1 (M1 a1 + M2 a2 + M3 a3)`. Far from people the goal decides;
# near them the metrics of `collision` and `repulsion` outweigh it along the gradient, and leave the way along the surface free.

# %%
policy, potential = params.policy, params.potential
velocity = jnp.asarray(np.gradient(np.asarray(runs[0][0].record.tool), cell.dt, axis=0)[max(tick_near - 125, 0)])
none = jnp.zeros(3)
by_people = PERSON_FADE**potential.exponent


def leaves(x):
    """Metric (3, 3) and acceleration (3,) of each leaf."""
    at = cell.field.read(params.field, now, x)
    reach, fade = jnp.asarray(potential.zeta * potential.person_radius), jnp.asarray(by_people)
    return (
        target(policy.target, x, velocity, scene.goal, none, none),
        collision(policy.collision, at.distance, at.gradient, velocity),
        repulsion(
            policy.repulsion, potential.k_rep, reach, fade, at.person_distance[0], at.person_gradient[0], velocity
        ),
    )


def together(x):
    parts = leaves(x)
    M = sum(m for m, _ in parts) + 1e-3 * jnp.eye(3)
    return M, jnp.linalg.solve(M, sum(m @ acceleration for m, acceleration in parts))


few = np.arange(len(flat)).reshape(49, 49)[2::4, 2::4].ravel()
each = [*jax.jit(jax.vmap(leaves))(places[few]), jax.jit(jax.vmap(together))(places[few])]
most = max(float(np.linalg.eigvalsh(np.asarray(M)[:, :2, :2]).max()) for M, _ in each)
figure, grid = plt.subplots(2, 2, figsize=(11, 10.4), layout="constrained")
for axes, (M, acceleration), title in zip(
    grid.ravel(), each, ("target", "collision", "repulsion of people", "together"), strict=True
):
    flat_M = np.asarray(M)[:, :2, :2]
    size, direction = np.linalg.eigh(flat_M)
    half = 0.047 * (np.maximum(size, 0) / most) ** 0.25  # the fourth root, so that small ones are seen
    for place, h, v in zip(flat[few], half, direction, strict=True):
        angle = np.degrees(np.arctan2(v[1, 1], v[0, 1]))
        axes.add_patch(Ellipse(place, 2 * h[1], 2 * h[0], angle=angle, color="#1f5fa8", alpha=0.25, lw=0))
    asked = np.asarray(acceleration)[:, :2]
    length = np.linalg.norm(asked, axis=1, keepdims=True)
    shown = asked / np.maximum(length, 1e-9) * np.tanh(length / 3.0) * 0.08
    axes.quiver(*flat[few].T, *shown.T, angles="xy", scale_units="xy", scale=1, width=0.003, color="#222222")
    finish(axes, f"{title}: largest {length.max():.1f} m/s$^2$, metric to {size.max():.3g}")
plt.show()

# %% [markdown]
# ## Who decides along the reach
#
# How much each leaf weighs at the tool along the episodes with policies alone, as the trace of its metric; below, how far the tool
# is from where the path wanted it. Near its goal the target weighs 20 times as much as on the way: by default repulsion has hardly
# a say there, and it is the safety layer that makes room. With K_rep 1e-3 the policies do it by themselves, earlier.

# %%
at_ticks = np.arange(0, cell.ticks, every)
stamps = np.asarray(world.frames.stamp)
rows = np.clip(np.searchsorted(stamps, np.asarray(cell.times)[at_ticks] - cell.latency, side="right") - 1, 0, None)


LEAVES = ("target", "collision", "repulsion of people")


def largest(k_rep, x, xd, moving):
    at = cell.field.read(params.field, Fields(fields.static, moving), x)
    reach, fade = jnp.asarray(potential.zeta * potential.person_radius), jnp.asarray(by_people)
    M = (
        target(policy.target, x, xd, scene.goal, none, none)[0],
        collision(policy.collision, at.distance, at.gradient, xd)[0],
        repulsion(policy.repulsion, k_rep, reach, fade, at.person_distance[0], at.person_gradient[0], xd)[0],
    )
    return jnp.stack([jnp.trace(m) for m in M]), at.person_distance[0]


@jax.jit
def along(k_rep, x, xd):
    moving = jax.tree.map(lambda v: v[rows], fields.moving)
    return jax.lax.map(lambda one: largest(k_rep, *one), (x, xd, moving))


figure, grid = plt.subplots(2, 2, figsize=(11, 5.6), sharex=True, sharey="row", layout="constrained")
for column, k, p in ((0, 1, policies), (1, 2, strong)):
    above, below = grid[:, column]
    record = runs[k][0].record
    tool = np.asarray(record.tool)
    speeds = np.gradient(tool, cell.dt, axis=0).astype(np.float32)
    k_rep = jnp.asarray(p.potential.k_rep, jnp.float32)
    weighs, d_people = along(k_rep, jnp.asarray(tool[at_ticks]), jnp.asarray(speeds[at_ticks]))
    for w, name, colour in zip(np.asarray(weighs).T, LEAVES, COLOURS, strict=False):
        above.semilogy(times, np.maximum(w, 1e-3), color=colour, label=name)
    off = np.linalg.norm(tool - np.asarray(record.reference), axis=1)[at_ticks]
    below.plot(times, off, color="#1f5fa8", label="tool from its reference")
    below.plot(times, d_people, color="#d0702e", label="tool from people, lower bound")
    above.set_title(NAMES[k], fontsize=10)
    below.set(xlabel="time [s]", ylim=(-0.05, 1.0))
grid[0, 0].set(ylabel="trace of the metric at the tool [1]")
grid[1, 0].set(ylabel="distance [m]")
grid[0, 0].legend(frameon=False, fontsize=8)
grid[1, 0].legend(frameon=False, fontsize=8)
plt.show()
print(f"all of it in {time.monotonic() - begin:.0f} s")
