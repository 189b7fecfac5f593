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
# # Tune three parameters by the gradient of an episode
#
# The whole loop, from plan to joint torques, is one differentiable function of its parameters. Here three of them fall down the
# slope of a loss over one short episode: attraction `K_att`, repulsion `K_rep` and safety factor `zeta`. `python -m
# experiments.tune` does the same in many worlds, with checkpoints and held-out worlds ([docs/tuning.md](../docs/tuning.md)).
#
# Most of the time goes into compiling one program, which is kept: 103 s on two busy cores when it was there, and about 140 CPU seconds
# more the first time.

# %%
# %matplotlib inline
import time
from dataclasses import replace

import jax
import jax.numpy as jnp
import matplotlib.pyplot as plt
import numpy as np
import optax
from IPython.display import display

from hrcjax.cells.named_cell import NamedCell
from hrcjax.cells.ur5 import make_cell
from hrcjax.field import GridLayout
from hrcjax.lab.compiled import keep_compiled
from hrcjax.map import MapLayout
from hrcjax.numerics import unrolled_options
from hrcjax.plan import PathParams, PlanSizes
from hrcjax.presence import VoxelLayout
from hrcjax.sense.rig import cell_rig
from hrcjax.sim import Params, episode, make_world, potential_planner
from hrcjax.sim.survey import SenseParams
from hrcjax.tune import choose, initial_tuning, parse_losses, tune_step, values_and_gradients
from hrcjax.viz import Obstacles, PathLine, plan_view
from hrcjax.world import motion_named, scene_named

keep_compiled()
begin = time.monotonic()

# %% [markdown]
# ## A short episode
#
# The scene of the Robotica paper and 8 seconds, in which a slow arm does not arrive. A person passes by. Sensing is at twice the
# usual spacing, and the planner is the paper's, of the tool alone, to be quick.

# %%
cell = replace(
    make_cell(),
    ticks=1000,
    plan=potential_planner(PlanSizes(steps=60, waypoints=24, iterations=8)),
    moving_points=256,
    obstacles=4,
    layout=MapLayout((-2.0, -2.0, 0.0), (20, 20, 7), 0.05, capacity=256, levels=3, seen=256, born=128, refitted=64),
    grid=GridLayout((-1.2, -1.2, -0.1), (49, 49, 29), 0.05),
    voxels=VoxelLayout((-2.0, -2.0, 0.0), (40, 40, 14), 0.1),
)
scene = scene_named("robotica", 0)
person = motion_named("pass_by", scene, 0, cell.ticks * cell.dt, 30.0)
world = make_world(cell, scene, person, cell_rig(scene, decimation=8), jax.random.key(0), SenseParams(settled=1000.0))
print(f"a world after {time.monotonic() - begin:.0f} s")

# %% [markdown]
# ## Parameters, loss, and one program
#
# Every parameter stays within its bounds; the optimiser moves coordinates that have none. The loss is the sound
# score, with a smooth share of success where a run fails, and the way that remains. `STARTS` settings run side by side: starts of the optimiser first, points of the landscape
# later, so that one program does both. What else is wanted of an episode, here the tool's path, comes along as terms of weight 0.

# %%
STARTS, STEPS, EVERY = 9, 16, 20
named = NamedCell(cell, Params(plan=PathParams()))
chosen = choose(
    ["K_att=0.01:0.2", "K_rep=1e-6:1e-3", "zeta=1.2:5"], named.params, named.known_aliases(), named.known_domains()
)
losses, weights = parse_losses(["sound=1", "progress=0.5"])
samples = len(cell.times[::EVERY])


def terms(params, world):
    run = episode(params, cell, world, cell.field.fit(params.field, world.frames))
    each = jnp.stack([loss.of(params, cell, world, run) for loss in losses])
    return jnp.concatenate([each, run.record.tool[::EVERY].ravel()])


def at(vectors):
    weighed = [*weights, *[0.0] * (3 * samples)]
    worlds = jax.tree.map(lambda a: a[None], world)
    return values_and_gradients(terms, weighed, lambda v: chosen.params(named.params, v), vectors, worlds)


first = jnp.asarray(chosen.start(), jnp.float32)
others = [chosen.drawn(key, first, 0.5) for key in jax.random.split(jax.random.key(0), STARTS - 1)]
optimiser = optax.adam(0.25)
state = initial_tuning(jnp.stack([first, *others]), optimiser, jax.random.key(0))
program = jax.jit(at, compiler_options=unrolled_options()).lower(state.vector).compile()
print(f"compiled after {time.monotonic() - begin:.0f} s")

# %% [markdown]
# ## Steps
#
# A start whose loss or gradient is not finite would stand still.

# %%
history = []
for _ in range(STEPS):
    found = program(state.vector)
    history.append((state.vector, found))
    state = tune_step(state, found, optimiser)
loss = np.array([found.loss for _, found in history])
way = np.array([jax.vmap(chosen.values)(vectors) for vectors, _ in history])
paths = np.array([found.terms[:, len(losses) :].reshape(STARTS, samples, 3) for _, found in history])
step, best = np.unravel_index(np.nanargmin(loss), loss.shape)
print(f"{STEPS} steps of {STARTS} starts after {time.monotonic() - begin:.0f} s")
print(
    f"loss {loss[0, 0]:.4f} before, {np.nanmin(loss[:, 0]):.4f} from there, {loss[step, best]:.4f} from the best start"
)
for name, before, after in zip(chosen.names, way[0, 0], way[step, best], strict=True):
    print(f"{name}: {before:.4g} before, {after:.4g} after")

# %%
figure, axes = plt.subplots(figsize=(7, 3.5))
axes.plot(loss, color="#cccccc")
axes.plot(loss[:, 0], color="#2a9d5c", lw=2, label="from the defaults")
axes.plot(loss[:, best], color="#1f5fa8", lw=2, ls="--", label="best start")
axes.set(xlabel="step", ylabel="loss [1]", title="Loss of every start")
axes.legend()
plt.show()

# %% [markdown]
# ## The path before and after

# %%
lines = [
    PathLine(paths[0, 0], "before", "#d0702e", dashed=True),
    PathLine(paths[step, best], "after"),
]
solids = Obstacles(*(np.asarray(a) for a in (scene.kind, scene.center, scene.size, scene.yaw, scene.mask)))
figure, _ = plan_view(lines, solids, start=np.asarray(scene.start), goal=np.asarray(scene.goal), title="From above")
display(figure)

# %% [markdown]
# ## The landscape
#
# The loss over two parameters, the third as tuned, and the ways of the optimiser on it, projected: a start with another third
# parameter walks on another landscape than the one drawn. Steps in it are switches of the loop, such as the side on which an
# obstacle is passed: there the gradient is that of one side.

# %%
SIDE = 9
across, up = 0, 2
steps = np.linspace(-3, 3, SIDE)
points = np.tile(np.asarray(history[step][0][best]), (SIDE, SIDE, 1))
points[..., across], points[..., up] = np.meshgrid(steps, steps, indexing="ij")
flat = points.reshape(-1, STARTS, 3)
over = np.concatenate([program(jnp.asarray(some)).loss for some in flat]).reshape(SIDE, SIDE)
values = np.asarray(jax.vmap(jax.vmap(chosen.values))(jnp.asarray(points)))

figure, axes = plt.subplots(figsize=(7.5, 5))
shown = axes.pcolormesh(values[:, 0, across], values[0, :, up], over.T, shading="nearest", cmap="viridis")
figure.colorbar(shown, label="loss [1]")
axes.contour(values[:, 0, across], values[0, :, up], over.T, 12, colors="white", linewidths=0.6)
for k in range(STARTS):
    axes.plot(way[:, k, across], way[:, k, up], color="#bbbbbb", lw=0.8)
axes.plot(way[:, 0, across], way[:, 0, up], ".-", color="#2a9d5c", label="from the defaults")
axes.plot(way[:, best, across], way[:, best, up], ".-", color="#d0702e", label="best start")
axes.plot(*way[step, best, [across, up]], "*", color="white", mec="black", ms=14, label="tuned")
axes.set(xscale="log", xlabel=chosen.names[across], ylabel=chosen.names[up], title="The loss over two parameters")
axes.legend()
plt.show()
print(f"all of it in {time.monotonic() - begin:.0f} s")
