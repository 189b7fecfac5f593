"""The score of table VIII over length and bending energy."""

import numpy as np
from matplotlib.figure import Figure

from hrcjax.viz.style import (
    COLOUR_MAP,
    WORST,
    as_row,
    heading,
    new_figure,
    tidy,
)  # fmt: skip

from .paths import BENDING_WEIGHTS, SCENE, ZETAS, measured
from .printed import PATHS
from .readings import row_scene
from .rows import Cases
from .scores import scores_of


def scores_figure(cases: Cases, reading: str) -> Figure:
    """The score of table VIII over length and bending energy, with the candidates: the paper's and ours."""
    figure = new_figure(11.5, 4.8)
    paths, scene = cases[f"paths/{reading}"], row_scene(reading, SCENE)
    ours = [measured(path, scene) for path in paths["planned"][-1]]
    groups = [
        ("the paper's candidates", [(one.name, one.length, one.bending) for one in PATHS]),
        (f"planned, {ZETAS[-1]:g} radii, {reading}", [(rf"$\omega_2$ {weight:g} m", 100 * one.length, one.bending / 100) for weight, one in zip(BENDING_WEIGHTS, ours, strict=True)]),
    ]  # fmt: skip
    all_axes = as_row(figure.subplots(1, 2))
    for axes, (title, some) in zip(all_axes, groups, strict=True):
        length, bending = (np.array([one[k] for one in some]) for k in (1, 2))
        spans = [(v.min() - 0.15 * np.ptp(v), v.max() + 0.35 * np.ptp(v)) for v in (length, bending)]
        x, y = (np.linspace(*span, 60) for span in spans)
        unit = [
            (grid - v.min()) / max(np.ptp(v), 1e-9)
            for grid, v in zip(np.meshgrid(x, y), (length, bending), strict=True)
        ]
        axes.pcolormesh(x, y, 0.5 * unit[0] + 0.5 * unit[1], cmap=COLOUR_MAP, vmin=0, vmax=1.3, rasterized=True)
        lines = axes.contour(
            x, y, 0.5 * unit[0] + 0.5 * unit[1], levels=np.arange(0.1, 1.3, 0.1), colors="white", linewidths=0.6
        )
        axes.clabel(lines, fontsize=6.5, fmt="%.1f")
        for (name, a, b), score in zip(some, scores_of(length, bending), strict=True):
            axes.plot(a, b, "o", color=WORST, mec="white", ms=8)
            axes.annotate(f" {name}: {score:.2f}", (a, b), fontsize=8, color="white", fontweight="bold", va="bottom")
        axes.set(xlabel="length [cm]", ylabel="bending energy [1/cm]", title=title)
        tidy(axes)
    bar = figure.colorbar(all_axes[0].collections[0], ax=all_axes)
    bar.set_label("score, the lower the better [1]", fontsize=9)
    heading(figure, r"Score of table VIII, $\omega_1 = \omega_2 = 0.5$")
    return figure
