"""A world of a run as the figures show it."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from hrcjax.lab.any_name import title
from hrcjax.sweeps.dataset import WORLD_DIMS
from hrcjax.viz import Obstacles, PersonPoses

POSES = 3
"""Number of poses of the person in the path figures."""


def world_name(results: xr.Dataset, dim: str) -> str:
    """The first scene, person or seed; a file without its folder."""
    name = str(results[dim].values[0])
    return title(Path(re.split(r"\.bvh(?:,|$)", name, flags=re.IGNORECASE)[0]).name if dim == "person" else name)


def world_title(results: xr.Dataset) -> str:
    """The first world in words."""
    return ", ".join(f"{dim} {world_name(results, dim)}" for dim in WORLD_DIMS)


def drawn_world(world: xr.Dataset, when: float | None = None) -> dict[str, Any]:
    """Obstacles, person, start and goal of one world, as far as stored: arguments of the path figures.

    Args:
        when: time of the person's only pose; None: some poses over the whole time [s].
    """
    found: dict[str, Any] = {name: world[name].values for name in ("start", "goal") if name in world}
    if "obstacle_kind" in world:
        fields = ("kind", "center", "size", "yaw", "mask")
        obstacles = Obstacles(*(world[f"obstacle_{name}"].values for name in fields))
        found["obstacles"] = obstacles._replace(mask=world.obstacle_mask.values.astype(bool))
    if "person_a" in world:
        times = world.frame.values if "frame" in world.coords else np.arange(world.sizes["frame"], dtype=float)
        spread = np.linspace(0, len(times) - 1, POSES + 1)[:-1].round().astype(int)
        at = np.unique(spread if when is None else [np.argmin(np.abs(times - when))])
        a, b = world.person_a.values[at], world.person_b.values[at]
        found["person"] = PersonPoses(a, b, world.person_radius.values, times[at])
    return found
