"""The potential in a slice, with the streamlines of its force and the path."""

import functools
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from numpy.typing import NDArray

from hrcjax.plan import PotentialParams, potential
from hrcjax.plan.baseline import plain_potential
from hrcjax.viz.path_view import PathLine, plan_view
from hrcjax.viz.style import (
    COLOUR_MAP,
    TEXT,
    WORST,
    as_row,
    heading,
    new_figure,
)  # fmt: skip
from hrcjax.world.scene import Scene, obstacle_distances

from .path_figures import ends
from .printed import TIMES, TimeRow
from .readings import row_scene
from .rows import Cases
from .times import gradient_params, improved_params

HEIGHT = 0.12
"""Of the slices through the field [m]."""


def _slice(
    params: PotentialParams, scene: Scene, radius: jax.Array, scaled: bool
) -> tuple[NDArray, NDArray, NDArray, NDArray]:
    """x, y [m], the potential over that of the start [1], and its force's direction, in the slice; indexed (y, x)."""
    x, y = np.linspace(0.0, 0.8, 129), np.linspace(0.1, 0.8, 113)
    points = np.stack([*np.meshgrid(x, y), np.full((len(y), len(x)), HEIGHT)], axis=-1)

    with jax.enable_x64(True):
        found, slope = _field()(params, scene, radius, jnp.asarray(points.reshape(-1, 3)), scaled)
        start, _ = _field()(params, scene, radius, scene.start[None], scaled)
    shape = len(y), len(x)
    return x, y, np.asarray(found / start).reshape(shape), -np.asarray(slope).reshape(*shape, 3)


@functools.cache
def _field() -> Any:
    """The potential and its slope at many points, compiled once for each field and number of points."""

    def all_of(params: PotentialParams, scene: Scene, radius: jax.Array, points: jax.Array, scaled: bool) -> Any:
        def value(q: jax.Array) -> jax.Array:
            return potential(params, q, scene.goal, lambda p: obstacle_distances(scene, p), radius, scaled)

        return jax.vmap(jax.value_and_grad(value))(points)

    return jax.jit(all_of, static_argnums=4)


def field_figure(cases: Cases, reading: str) -> Figure:
    """The potential in a slice, streamlines of its force, and the path: improved field of little and much repulsion, gradient descent."""
    figure = new_figure(15.0, 5.2)
    rows = [one for one in TIMES if one.table == "VI"]
    shown: list[tuple[str, TimeRow, bool]] = [
        (f"improved field, $K_{{rep}}$ {one.k_rep:g} cm²", one, True) for one in (rows[0], rows[-1])
    ]
    shown += [(f"gradient descent, $K_{{rep}}$ {one.gda_k_rep:g} cm⁴", one, False) for one in rows[-1:]]
    times = cases[f"times/{reading}"]
    all_axes = as_row(figure.subplots(1, 3))
    for axes, (title, one, improved) in zip(all_axes, shown, strict=True):
        scene, k = row_scene(reading, one), TIMES.index(one)
        with jax.enable_x64(True):
            params = improved_params(one) if improved else plain_potential(gradient_params(one))
            radius = scene.radius if improved else jnp.ones_like(scene.radius)
        x, y, level, way = _slice(params, scene, radius, improved)
        name = "iapf" if improved else "gda"
        axes.pcolormesh(x, y, np.clip(level, 1e-3, 10), norm=LogNorm(1e-3, 10), cmap=COLOUR_MAP, rasterized=True)
        size = np.maximum(np.linalg.norm(way[..., :2], axis=-1, keepdims=True), 1e-12)
        axes.streamplot(
            x, y, *np.moveaxis(way[..., :2] / size, -1, 0), color="white", linewidth=0.5, density=1.1, arrowsize=0.6
        )
        path = times[f"{name}_path"][k][: int(times[f"{name}_steps"][k]) + 1]
        plan_view([PathLine(path, "path", WORST)], None, None, *ends(scene), "", axes)
        axes.legend(fontsize=8, loc="upper right")
        axes.set(xlim=(0.0, 0.8), ylim=(0.1, 0.8), title=title)
        axes.title.set(fontsize=10, color=TEXT)
        axes.grid(False)
    bar = figure.colorbar(all_axes[0].collections[0], ax=all_axes, shrink=0.85, extend="both")
    bar.set_label("potential over that of the start [1]", fontsize=9)
    heading(figure, f"Potential and streamlines of its force at z = {100 * HEIGHT:.0f} cm, {reading}; paths from above")
    return figure
