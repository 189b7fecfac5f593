"""A pair of runs side by side as a film: arm, person and the tool's way, from above and from the front."""

from collections.abc import Mapping, Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from hrcjax.robot import arm_capsules
from hrcjax.sim import Cell
from hrcjax.viz.style import PERSON, ZONE_COLOURS, new_figure, tidy
from hrcjax.world import Person
from hrcjax.world.person import person_at

from .trace import Trace

RATE = 8.0
"""Pictures in a second of the run [Hz]."""
VIEWS = ((0, 1, "x [m]", "y [m]", (-1.0, 0.55), (-0.35, 1.15)), (0, 2, "x [m]", "z [m]", (-1.0, 0.55), (-0.05, 0.95)))
"""Axes, labels and limits: from above, from the front."""
TRAIL = 3.0
"""How long the tool's way stays [s]."""


def pictures(cell: Cell, person: Person, traces: Mapping[str, Trace]) -> list[NDArray]:
    """The film's pictures (height width 3), bytes.

    Args:
        traces: by the name that is written above.
    """
    first = next(iter(traces.values()))
    times = np.arange(0, first.t[-1], 1 / RATE)
    bodies = jax.jit(jax.vmap(lambda t: person_at(person, t)))(jnp.asarray(times, jnp.float32))
    arms = {name: _arm(cell, one, times) for name, one in traces.items()}
    figure = new_figure(4.2 * len(traces), 6.4)
    axes = figure.subplots(len(VIEWS), len(traces), squeeze=False)
    canvas: Any = figure.canvas
    found = []
    for k, t in enumerate(times):
        for column, (name, trace) in enumerate(traces.items()):
            for line, view in enumerate(VIEWS):
                part = axes[line, column]
                part.clear()
                title = f"{name}, {t:.1f} s, {trace.separation[round(t / trace.dt)]:.2f} m" if line == 0 else ""
                _draw(part, view, (bodies.a[k], bodies.b[k], bodies.radius[k]), PERSON, 0.55)
                tick = round(t / trace.dt)
                colour = (
                    ZONE_COLOURS[int(trace.zone[tick])] if name.startswith(("ours", "nearest", "path")) else "#30343b"
                )
                _draw(part, view, tuple(x[k] for x in arms[name]), colour, 0.9)
                trail = trace.tool[max(0, tick - round(TRAIL / trace.dt)) : tick + 1]
                part.plot(trail[:, view[0]], trail[:, view[1]], color="#1f5fa8", linewidth=1.2)
                part.set(xlabel=view[2], ylabel=view[3], xlim=view[4], ylim=view[5], aspect="equal", title=title)
                tidy(part)
        canvas.draw()
        figure.set_layout_engine("none")  # solved once: at every picture it would take most of the time
        found.append(np.asarray(canvas.buffer_rgba())[..., :3].copy())
    return found


def _arm(cell: Cell, trace: Trace, times: NDArray) -> tuple[Any, Any, Any]:
    ticks = np.minimum(np.round(times / trace.dt).astype(int), len(trace.t) - 1)
    capsules = jax.jit(jax.vmap(lambda q: arm_capsules(cell.arm, q)))(jnp.asarray(trace.q[ticks], jnp.float32))
    return capsules.a, capsules.b, capsules.radius


def _draw(part: Any, view: Sequence[Any], capsules: tuple[Any, ...], colour: str, alpha: float) -> None:
    """Capsules as thick lines with round ends; where nobody is, none."""
    a, b, radius = (np.asarray(x, float) for x in capsules)
    i, j = view[0], view[1]
    # points of a line's width in a metre, from the size of the axes on the page
    box = part.get_window_extent()
    scale = min(box.width / np.ptp(view[4]), box.height / np.ptp(view[5])) * 72 / part.figure.dpi
    for p, q, r in zip(a, b, radius, strict=True):
        if r > 0:
            part.plot(
                [p[i], q[i]], [p[j], q[j]], color=colour, alpha=alpha, linewidth=2 * r * scale, solid_capstyle="round"
            )
