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
# # One frame through the map
#
# A depth camera observes a table, which the map contains from earlier frames. In the next frame a box has been moved. Step
# by step: the point cloud of the frame, its own field (the frustum field), the labels static, dynamic and new, the fused
# field, its gradient, and the surface normals.

# %%
# %matplotlib inline
import jax
import jax.numpy as jnp
import matplotlib.pyplot as plt
import numpy as np
from IPython.display import display

from hrcjax.map import (
    LABELS,
    FrameParams,
    MapLayout,
    describe_frame,
    distance_bound,
    empty_map,
    initial_stream,
    map_distances_and_gradients,
    map_points,
    map_surface,
    surface_view,
    take_frame,
)
from hrcjax.sense import NoiseParams, d435i
from hrcjax.sense.camera import render_scene
from hrcjax.sense.noise import measure
from hrcjax.viz import POINT_COLOURS, FieldSlice, cloud_views, field_slices
from hrcjax.world.scene import BOX, SPHERE
from hrcjax.world.scenes import Obstacle, make_scene

# %% [markdown]
# ## The scene and the camera
# A ball is static; a box is on the left first, then on the right. The camera has the noise of a D435i.

# %%
BALL = Obstacle(SPHERE, (0.0, 0.25, 0.1), (0.1, 0.1, 0.1), 0.0, 0.1)


def scene_with_box(x):
    box = Obstacle(BOX, (x, 0.0, 0.08), (0.06, 0.06, 0.08), 0.4, 0.1)
    return make_scene([BALL, box], (0.0,) * 3, (0.1,) * 3, (0.0,) * 3, (1.0,) * 3)


camera = d435i(jnp.asarray([0.0, -0.9, 0.8], jnp.float32), jnp.asarray([0.0, 0.1, 0.05], jnp.float32), 1)


@jax.jit
def image_of(scene, key):
    return measure(render_scene(camera, scene), camera, key, NoiseParams())


before, after = scene_with_box(-0.2), scene_with_box(0.2)
depth = image_of(after, jax.random.key(100))
figure, axes = plt.subplots(figsize=(6, 4.2))
shown = axes.imshow(np.where(depth > 0, depth, np.nan), cmap="viridis")
figure.colorbar(shown, label="depth [m]")
axes.set(title="the new frame; white: no measurement", xlabel="column [px]", ylabel="row [px]")
# %% [markdown]
# ## The cloud of the frame
# A tile of 4 x 4 pixels gives one mean point; flying pixels are dropped.

# %%
layout = MapLayout(lower=(-0.7, -0.7, -0.2), shape=(14, 14, 8), capacity=1024, seen=1024, born=1024, refitted=1024)
params = FrameParams()
view = jax.jit(lambda depth: surface_view(params.map, camera, depth))(depth)
cloud = np.asarray(view.points)[np.asarray(view.mask)]
print(f"{depth.size} pixels, {int((depth > 0).sum())} measured, {len(cloud)} points")

# %% [markdown]
# ## The map before, and the frustum field
# Ten frames of the old scene are fused into the map. The frustum field is the field of the new frame alone: a map of that
# frame only.


# %%
@jax.jit
def take(state, stream, stamp, depth):
    return take_frame(layout, params, state, stream, stamp, camera, depth)


@jax.jit
def field_on(state, x):
    return map_distances_and_gradients(layout, state.levels, params.map.ratio, x, corrected=True)


state, stream = empty_map(layout), initial_stream()
for k in range(10):
    state, stream, report, refused = take(state, stream, jnp.float32(k / 30), image_of(before, jax.random.key(k)))
    assert describe_frame(int(refused)) == "none"
known, stream_known = state, stream
frustum, *_ = take(empty_map(layout), initial_stream(), jnp.float32(0.0), depth)

# %% [markdown]
# ## Labels
# After the new frame: points that it observes again are static, those in its free space are dynamic, those far from all
# earlier points are new. Dynamic points are removed after the next frame in whose free space they are.

# %%
fused, stream, report, refused = take(known, stream_known, jnp.float32(10 / 30), depth)
points, labels, _, _ = map_points(fused, 16384)
there = np.asarray(points.mask)
xyz, what = np.asarray(points.points)[there], np.asarray(labels)[there]
print({name: int((what == k).sum()) for k, name in enumerate(LABELS) if k})
cloud_views(xyz, what, "the map after the new frame")[0]

# %% [markdown]
# ## Fields: of the frame alone, and fused
# Slices 12 cm above the table and through the boxes. The frame alone has no surfaces where the ball occludes them. Arrows:
# the gradient, which points away from the surfaces.

# %%
right, up = np.linspace(-0.5, 0.5, 81), np.linspace(-0.4, 0.6, 81)


def slice_at(state, axis, at):
    """Distance and gradient on a plane across one axis."""
    a = np.linspace(-0.5, 0.5, 61)
    b = np.linspace(-0.4, 0.6, 61) if axis == 2 else np.linspace(-0.1, 0.5, 61)
    grid = np.stack(np.meshgrid(a, b, indexing="ij"), axis=-1).reshape(-1, 2)
    x = np.insert(grid, axis, at, axis=1).astype(np.float32)
    d, g = (np.asarray(v) for v in field_on(state, jnp.asarray(x)))
    flat = np.delete(g, axis, axis=1)
    some = np.arange(len(grid)).reshape(len(a), len(b))[::6, ::6].ravel()
    return FieldSlice(at, a, b, d.reshape(len(a), len(b)), np.concatenate([grid[some], flat[some]], axis=1))


for state, name in ((frustum, "frustum field: the frame alone"), (fused, "fused field")):
    parts = [slice_at(state, 2, 0.12), slice_at(state, 1, 0.0), slice_at(state, 0, 0.2)]
    display(field_slices(parts, title=name, highest=0.4)[0])

# %% [markdown]
# ## Uncertainty
# The lower bound holds for 95 % of queries: it includes the noise and the spacing of the points.

# %%
line = np.stack([np.full(31, 0.0), np.full(31, 0.25), np.linspace(0.21, 0.6, 31)], axis=1).astype(np.float32)
d, _ = field_on(fused, jnp.asarray(line))
bound = jax.jit(jax.vmap(lambda x: distance_bound(layout, fused, params.map.ratio, x)))(line)
figure, axes = plt.subplots(figsize=(6, 3.4))
axes.plot(line[:, 2] - 0.2, line[:, 2] - 0.2, color="0.6", label="truth: straight up from the ball")
axes.plot(line[:, 2] - 0.2, d, label="distance")
axes.plot(line[:, 2] - 0.2, bound, ls="--", label="95 % lower bound")
axes.set(xlabel="height over the ball [m]", ylabel="distance [m]", title="distance and its bound")
axes.legend(frameon=False)
# %% [markdown]
# ## Normals
# From the Hessian of the occupancy, towards the camera. Points where the curvature is too large for the length scale are
# flagged by the map and not drawn.

# %%
near = xyz[np.linalg.norm(xyz - [0.0, 0.25, 0.1], axis=1) < 0.3]
surface = jax.jit(jax.vmap(lambda x: map_surface(layout, fused.levels, x, camera.position)))(jnp.asarray(near))
good = np.asarray(surface.reasons) == 0
print(f"{good.sum()} of {len(near)} points have a normal")
on_ball = good & (np.abs(np.linalg.norm(near - [0.0, 0.25, 0.1], axis=1) - 0.1) < 0.01) & (near[:, 2] > 0.06)
outward = (near - [0.0, 0.25, 0.1]) / np.linalg.norm(near - [0.0, 0.25, 0.1], axis=1)[:, None]
angle = np.degrees(np.arccos(np.clip(np.sum(outward * np.asarray(surface.normal), axis=1), -1, 1)))
print(f"on the ball: median angle to the true normal {np.median(angle[on_ball]):.1f} degrees")
figure, axes = plt.subplots(figsize=(5, 5))
axes.scatter(near[:, 1], near[:, 2], s=4, color=POINT_COLOURS[2])
normals = np.asarray(surface.normal)[good]
axes.quiver(
    near[good, 1], near[good, 2], normals[:, 1], normals[:, 2], angles="xy", scale_units="xy", scale=20, width=0.003
)
axes.set(xlabel="y [m]", ylabel="z [m]", title="normals, from the side", aspect="equal")
