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
# # A first look at a sweep
#
# A sweep runs the whole system for many settings of its parameters, for example
#
#     python -m experiments.sweep --quick
#
# and stores all results in one labelled dataset, which is opened and plotted here. The run is that of the environment
# variable `HRCJAX_RUN`, or else the newest one under `runs/`; if there is none, a quick one is started.

# %%
# %matplotlib inline
import os
import sys
from pathlib import Path

root = next(p for p in [Path.cwd(), *Path.cwd().parents] if (p / "experiments").is_dir())
sys.path.insert(0, str(root))

from hrcjax.sweeps.store import newest_run, open_run  # noqa: E402  # found through the line above

run = os.environ.get("HRCJAX_RUN") or newest_run(root / "runs")
if run is None:
    from experiments.sweep.__main__ import main

    run = root / "runs" / "notebook"
    status = main(["--quick", "--no-figures", "--out", str(run)])
    if status not in (0, 3):
        raise SystemExit(f"the sweep ended with status {status}")

# %%
ds = open_run(run)
ds  # noqa: B018  # the notebook shows it

# %% [markdown]
# ## The best settings
#
# Metrics have labels, units and a preferred direction. `status` is 0 where a setting succeeded.

# %%
from hrcjax.sweeps.summary import axis_labels, best_table, ranking, select  # noqa: E402

by = ds.attrs["rank"]
print(f"ranked by {by} [{ds[by].attrs['units']}]: {ds[by].attrs['long_name']}")
print(best_table(ds, by))

# %% [markdown]
# ## The score over all settings

# %%
from hrcjax.sweeps.figures import metric_figure, paths_figure, trade_off_figure, zones_figure  # noqa: E402

metric_figure(ds, by)

# %% [markdown]
# ## Trade-offs
#
# No other setting dominates those on the Pareto front in length, bending energy and clearance.

# %%
trade_off_figure(ds, by)

# %% [markdown]
# ## The best and the worst path, and the effect of the person

# %%
paths_figure(ds, by)

# %%
zones_figure(ds, by)

# %% [markdown]
# ## Other queries with xarray
#
# The best setting of each scene, person and seed, and the speed of the tool in the best one of all:

# %%
best = select(ds, int(ranking(ds, by)[0]))
print({label: float(best[label]) for label in axis_labels(ds)})
best[by].squeeze()
