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
# # From a cloud to a grasp
#
# Depth cameras look at a box on a table. Step by step: the cloud of the fused images, the normals of its points by the Hessian of their
# field, pairs of contacts between which two fingers hold, approaches that are free, and the motion of a UR5 there by its policies.
# `python -m experiments.grasp` does it for ten shapes, and lifts them in C MuJoCo.

# %%
# %matplotlib inline
import jax
import jax.numpy as jnp
import matplotlib.pyplot as plt
import numpy as np

from hrcjax.field import distance, fit_exact
from hrcjax.grasp import (
    GraspParams,
    Gripper,
    MotionPolicyParams,
    arm_with_gripper,
    by_hessian,
    by_plane,
    contacts,
    grasp_candidates,
    move_to_grasp,
    reach,
    seen_points,
)
from hrcjax.map import MapLayout, MapParams, empty_map, fuse, surface_view
from hrcjax.map.clean import within_box
from hrcjax.robot import load_arm
from hrcjax.sense import NoiseParams, d435i
from hrcjax.sense.camera import render_scene
from hrcjax.sense.noise import measure
from hrcjax.world.scene import BOX
from hrcjax.world.scenes import Obstacle, make_scene

# %% [markdown]
# ## What the cameras see
# Four views of a box of 5 x 8 x 9 cm, turned by 0.5 rad. Single images are noisy: the median of 16 is fused, into a map of 6 mm.

# %%
HALF, YAW, PLACE = (0.025, 0.04, 0.045), 0.5, (0.0, 0.5, 0.045)
scene = make_scene([Obstacle(BOX, PLACE, HALF, YAW, 0.1)], (0.0,) * 3, (0.1,) * 3, (0.0,) * 3, (1.0,) * 3)
middle = jnp.asarray(PLACE, jnp.float32)
eyes = [(0.35, 0.3, 0.4), (-0.35, 0.3, 0.4), (0.3, -0.3, 0.35), (-0.3, -0.3, 0.35)]
cameras = [d435i(middle + jnp.asarray(eye, jnp.float32), middle, 4) for eye in eyes]


@jax.jit
def image(camera, key):
    exact = render_scene(camera, scene)
    images = jax.lax.map(lambda k: measure(exact, camera, k, NoiseParams()), jax.random.split(key, 16))
    return images[0], jnp.nanmedian(jnp.where(images > 0, images, jnp.nan), axis=0)


images = [image(camera, jax.random.key(k)) for k, camera in enumerate(cameras)]
figure, panels = plt.subplots(1, 2, figsize=(9, 3.4))
for axes, shown, title in zip(panels, images[0], ("one image", "the median of 16"), strict=True):
    colours = axes.imshow(np.where(shown > 0, shown, np.nan), cmap="viridis")
    axes.set(title=title, xlabel="column [px]", ylabel="row [px]")
figure.colorbar(colours, ax=panels, label="depth [m]")
# %% [markdown]
# ## The cloud, and the normals of its points
# The Hessian of a Gaussian-process field knows the normal at the surface itself, where the gradient of a distance is 0 / 0: it is the
# eigenvector of the most negative eigenvalue. How much of the eigenvalues it has is the planarity; edges have little and are refused. The
# plane through 16 neighbours is the usual way.

# %%
SPACING = 0.006
layout = MapLayout(
    lower=(PLACE[0] - 0.144, PLACE[1] - 0.144, 0.0),
    shape=(12, 12, 6),
    spacing=SPACING,
    capacity=400,
    levels=2,
    seen=300,
    born=300,
    refitted=0,
)
fusing = MapParams(clear_distance=SPACING, new_distance=1.5 * SPACING, least_deviation=3e-4, through=SPACING)
low = jnp.asarray([layout.lower[0], layout.lower[1], 0.006], jnp.float32)
high = low + jnp.asarray([0.288, 0.288, 0.14], jnp.float32)


@jax.jit
def fused(state, camera, depth):
    return fuse(layout, fusing, state, camera, within_box(surface_view(fusing, camera, depth, 1), low, high))[0]


state = empty_map(layout)
for camera, (_, depth) in zip(cameras, images, strict=True):
    state = fused(state, camera, jnp.nan_to_num(depth))
seen = seen_points(state, 1024, low, high)
params, gripper = GraspParams(), Gripper()


@jax.jit
def normals(seen):
    field, _ = fit_exact(seen.cloud, params.field)
    ways = by_hessian(field, params.least_planarity), by_plane(seen.cloud, params.least_planarity)
    return field, [contacts(seen, way) for way in ways]


field, found = normals(seen)
mask = np.asarray(seen.cloud.mask)
points = np.asarray(seen.cloud.points)[mask]
turned = np.array([[np.cos(YAW), -np.sin(YAW), 0], [np.sin(YAW), np.cos(YAW), 0], [0, 0, 1]])
local = (points - PLACE) @ turned
face = np.argmin(np.abs(np.abs(local) - HALF), axis=1)
exact = np.sign(local[np.arange(len(local)), face])[:, None] * turned.T[face]
figure = plt.figure(figsize=(10, 3.8))
axes = figure.add_subplot(1, 2, 1, projection="3d")
used = np.asarray(found[0].mask)[mask]
axes.scatter(*points[~used].T, s=4, color="#d0702e", label="refused")
axes.quiver(*points[used].T, *(0.012 * np.asarray(found[0].normals)[mask][used]).T, color="#1f5fa8", linewidth=0.6)
axes.set(title="points with normals by the Hessian", xlabel="x [m]", ylabel="y [m]", zlabel="z [m]")
axes.set_aspect("equal")
axes.legend(fontsize=8)
axes = figure.add_subplot(1, 2, 2)
for way, name, colour in zip(found, ("Hessian", "plane through 16"), ("#1f5fa8", "#d0702e"), strict=True):
    use = np.asarray(way.mask)[mask]
    off = np.rad2deg(np.arccos(np.clip(np.sum(np.asarray(way.normals)[mask] * exact, axis=1), -1, 1)))[use]
    axes.plot(np.sort(off), np.linspace(0, 1, len(off)), color=colour, label=f"{name}: {len(off)} places")
axes.set(xlabel="error of the normal [deg]", ylabel="share of places", xlim=(0, 30))
axes.legend()

# %% [markdown]
# ## Candidates
# Every place looks for the partner with which it scores most: the line between them within both cones of friction (Nguyen 1988), flat, near
# the middle. Of the best pairs seven approaches are tried each; fingers and palm, as spheres, must stay 3 mm off what the field knows.


# %%
def clearance(x):
    return jnp.minimum(distance(field, x), x[2])


grasps = jax.jit(lambda found: grasp_candidates(found, middle, clearance, gripper, params))(found[0])
free = np.flatnonzero(grasps.mask)
arm = arm_with_gripper(load_arm(), gripper)
solved = jax.jit(jax.vmap(lambda R, p: reach(arm, R, p, params.approach)))(grasps.R[:16], grasps.p[:16])
taken = int(np.argmax(np.asarray(solved.ok) & np.asarray(grasps.mask[:16])))
print(
    f"{len(free)} free; {int((np.asarray(solved.ok) & np.asarray(grasps.mask[:16])).sum())} of the first 16 in reach; taken: {taken}"
)
figure = plt.figure(figsize=(5, 4.4))
axes = figure.add_subplot(projection="3d")
axes.scatter(*points.T, s=2, color="#8a8f98")
for g in [*free[1::6], taken]:
    R, p, half = np.asarray(grasps.R[g]), np.asarray(grasps.p[g]), float(grasps.opening[g]) / 2
    tip, palm = p + gripper.pad[1] * R[:, 2], p - gripper.length * R[:, 2]
    line = np.array([tip + half * R[:, 1], palm + half * R[:, 1], palm - half * R[:, 1], tip - half * R[:, 1]])
    axes.plot(*line.T, color="#1f5fa8" if g == taken else "#777777", linewidth=2.5 if g == taken else 0.7)
axes.set(title="some candidates; thick: the best in reach", xlabel="x [m]", ylabel="y [m]", zlabel="z [m]")
axes.set_aspect("equal")
# %% [markdown]
# ## The arm goes there
# Leaves, composed: a target for the tool point, one for its orientation on SO(3), collision of links, fingers and palm with the field,
# self-collision, joint limits, speed cap, damping, and posture. First along the straight line in joint space to the begin of the approach, then along
# it, where the leaf of the fingers reaches 6 mm only: they pass the object by some millimetres.

# %%
moved = jax.jit(
    lambda R, p, opening, before: move_to_grasp(
        arm, gripper, MotionPolicyParams(), clearance, R, p, opening, jnp.float32(params.approach), before
    )
)(grasps.R[taken], grasps.p[taken], grasps.opening[taken], solved.q_before[taken])
time = np.arange(len(moved.off)) / 125
print(f"at the end {1e3 * moved.off[-1]:.1f} mm and {np.rad2deg(moved.twist[-1]):.2f} degrees off")
figure, panels = plt.subplots(1, 2, figsize=(9, 3.2))
panels[0].semilogy(time, 1e3 * moved.off)
panels[0].set(xlabel="time [s]", ylabel="tool point to grasp [mm]")
panels[1].plot(time, moved.q)
panels[1].set(xlabel="time [s]", ylabel="joints [rad]")
panels[1].legend([f"{k + 1}" for k in range(6)], fontsize=7, ncols=2)
figure.tight_layout()
