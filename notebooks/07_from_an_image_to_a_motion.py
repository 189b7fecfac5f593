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
# # From an image to a planned motion
#
# Two depth cameras look at a table. Step by step: the mean of noisy images, the table's plane, what stands on it, shapes by points and by the
# rays that went past them, the obstacle grid of the Robotica paper, and a path of the whole arm among the shapes that were found.
# `python -m experiments.task_space` measures these steps on a hundred tables; `python -m experiments.sweep --obstacles sensed` plans so.

# %%
# %matplotlib inline
import jax
import matplotlib.pyplot as plt
import numpy as np

from hrcjax.cells import ur5_cell
from hrcjax.sense.rig import cell_rig
from hrcjax.sim import Task
from hrcjax.sim.prepare import posture_at
from hrcjax.task_space import instances_scene, map_table, obstacle_grid, simulated_views
from hrcjax.task_space.view import normals, points
from hrcjax.world import first_obstacles, obstacle_distances, robotica
from hrcjax.world.scene import BOX

scene = robotica()
cameras = cell_rig(scene, hand=False, decimation=1).cameras
single = simulated_views(cameras, scene, jax.random.key(1), images=1)
views = simulated_views(cameras, scene, jax.random.key(0), images=16)

# %% [markdown]
# ## One image, and the mean of sixteen
# At 1.8 m a pixel of one image is off by 14 mm. The scene stands still, so that a mean is allowed; pixels that fly between front and
# background are left out of it. Heights over the table:

# %%
figure, panels = plt.subplots(1, 2, figsize=(10, 3.6))
for axes, view, title in zip(panels, (single[0], views[0]), ("one image", "the mean of sixteen"), strict=True):
    height = np.where(view.depth > 0, points(view)[..., 2], np.nan)
    shown = axes.imshow(height, vmin=-0.05, vmax=0.25)
    axes.set(title=title, xlabel="column [px]", ylabel="row [px]")
figure.colorbar(shown, ax=panels, label="height [m]")

# %% [markdown]
# ## The table
# Normals by the plane through a window of pixels; the table is the highest large plane whose points' own normals agree with it.

# %%
up = np.array([0.0, 0.0, 1.0])
found = map_table(views, up)
n, exists = normals(views[0])
print(f"normal {found.table.normal.round(5)}, height {1e3 * found.table.offset:.2f} mm")
figure, axes = plt.subplots(figsize=(5.4, 3.6))
shown = axes.imshow(np.where(exists, np.rad2deg(np.arccos(np.clip(n @ found.table.normal, -1, 1))), np.nan), vmax=90)
axes.set(title="angle between normals and the table's", xlabel="column [px]", ylabel="row [px]")
figure.colorbar(shown, label="angle [deg]")

# %% [markdown]
# ## What stands on it, and the grid
# Sphere, column and box are fitted to each thing; what decides is how far points are off the surface and how much of the space that was seen
# through a shape would claim. Lines: shapes found; dots: their points; crosses: the true centres. Right: 1 (white) is an obstacle.

# %%
names = {0: "sphere", 1: "column", 2: "box", -1: "points"}
for one in found.instances:
    size, off = 1e3 * one.size, 1e3 * one.center_deviation
    print(
        f"{names[one.kind]} at {one.center.round(3)} m, half extents {size.round(1)} mm, centre to {off.max():.1f} mm, {100 * one.claimed:.1f} % of free rays claimed"
    )
grid = obstacle_grid(found, 0.01, np.array([-0.1, 0.0]), np.array([0.9, 0.9]))
figure, panels = plt.subplots(1, 2, figsize=(9, 4.2))
for one in found.instances:
    panels[0].plot(*one.points[::3, :2].T, ".", ms=1)
    if one.kind == BOX:
        corners = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1], [1, 1]]) * one.size[:2]
        c, s = np.cos(one.yaw), np.sin(one.yaw)
        outline = corners @ np.array([[c, s], [-s, c]]) + one.center[:2]
    else:
        turn = np.linspace(0, 2 * np.pi, 60)
        outline = one.center[:2] + one.size[0] * np.stack([np.cos(turn), np.sin(turn)], -1)
    panels[0].plot(*outline.T, color="#1f5fa8")
panels[0].plot(*np.asarray(scene.center)[np.asarray(scene.mask), :2].T, "kx")
panels[1].imshow(grid.cells.T, origin="lower", cmap="gray", extent=(-0.1, 0.9, 0.0, 0.9))
for axes in panels:
    axes.set(xlabel="x [m]", ylabel="y [m]", xlim=(-0.1, 0.9), ylim=(0.0, 0.9), aspect="equal")

# %% [markdown]
# ## A planned motion
# The planner gets the shapes that were found, and nothing of the true ones.

# %%
named = ur5_cell()
cell, params = named.cell, named.params
sensed = instances_scene(found.instances, scene, found.table)
count = max(int(sensed.mask.sum()), 1)
q_start = posture_at(cell, scene.start)
task = Task(first_obstacles(sensed, count), q_start, params.potential, cell.arm)
path = jax.jit(cell.plan)(params.plan, task)
tool = path.waypoints
true = jax.vmap(lambda x: obstacle_distances(scene, x).min())(tool)
print(
    f"{float(path.length):.2f} m; distance kept: {bool(path.clear)}; the tool's point stays {100 * float(true.min()):.1f} cm off the true obstacles"
)
tool = np.asarray(tool)
figure, axes = plt.subplots(figsize=(5, 4.6))
for one in found.instances:
    axes.add_patch(plt.Circle(one.center[:2], one.size[0], color="#8a8f98"))
axes.plot(*tool[:, :2].T, color="#1f5fa8")
axes.plot(*tool[[0, -1], :2].T, "o", color="#2a9d5c")
axes.set(xlabel="x [m]", ylabel="y [m]", aspect="equal", title="the tool's path among the shapes found, from above")
