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
# # What the knobs do
#
# * **K_att**, attraction: how strongly the goal pulls.
# * **K_rep**, repulsion: how strongly obstacles and people push.
# * **zeta**, safety factor: how far around an obstacle it pushes, in radii of the obstacle.
#
# A small grid of settings shows which of them matters for what, and how the motion changes along each. The run is that of
# the environment variable `HRCJAX_RUN`, or else one of 48 settings, started here; that takes some minutes the first time.

# %%
# %matplotlib inline
import os
import sys
from pathlib import Path

root = next(p for p in [Path.cwd(), *Path.cwd().parents] if (p / "experiments").is_dir())
sys.path.insert(0, str(root))

from hrcjax.sweeps.store import open_run  # noqa: E402  # found through the line above

run = os.environ.get("HRCJAX_RUN")
if run is None:
    from experiments.sweep.__main__ import main

    run = str(root / "runs" / "notebook-knobs")
    grid = ["K_att=log:0.03:0.2:4", "K_rep=log:1e-6:1e-3:4", "zeta=lin:2:4:3"]
    status = main(["--grid", *grid, "--no-figures", "--out", run])
    if status not in (0, 3):
        raise SystemExit(f"the sweep ended with status {status}")
ds = open_run(run)
by = ds.attrs["rank"]
print(f"score: {by}, {ds[by].attrs['long_name']}")
print(
    f"{float((ds.status == 0).mean()):.0%} of the settings succeed; scores from {float(ds[by].min()):.1f} to {float(ds[by].max()):.1f}"
)

# %% [markdown]
# ## Which knob matters for what
#
# Dark: the share of a metric's variance that a knob decides alone; pale: what it decides together with the others.

# %%
from hrcjax.sweeps.analysis import knob_effects, measures_of  # noqa: E402
from hrcjax.sweeps.knob_figures import knobs_figure, line_range_figure, sensitivity_figure, setting_figure  # noqa: E402

effects = knob_effects(ds, measures_of(ds, by))
sensitivity_figure(effects)

# %% [markdown]
# How far a knob alone moves a metric: the range along its lines through the grid, as a part of the range over all settings.

# %%
line_range_figure(effects)

# %% [markdown]
# ## How the motion changes
#
# Every row changes one knob and leaves the others as in the best setting. Paths from above, coloured by speed; below, the speed
# over time.

# %%
knobs_figure(ds, by)

# %% [markdown]
# ## Any setting beside the best
#
# The middle of the grid; with ipywidgets (`pip install -e '.[notebooks]'`) sliders choose any other.

# %%
middle = {label: float(ds[label][ds.sizes[label] // 2]) for label in effects.labels}
setting_figure(ds, by, middle)

# %%
try:
    import ipywidgets
except ImportError:
    print("no ipywidgets: no sliders")
else:
    sliders = {
        label: ipywidgets.SelectionSlider(
            options=[(f"{value:.3g}", float(value)) for value in ds[label].values],
            value=middle[label],
            description=label,
            continuous_update=False,
        )
        for label in effects.labels
    }
    ipywidgets.interact(lambda **values: setting_figure(ds, by, values), **sliders)
