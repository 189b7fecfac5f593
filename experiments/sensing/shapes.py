"""Exact shapes drawn in a view: capsules, and obstacles."""

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle, Polygon
from numpy.typing import NDArray

from .truth import COLUMN, SPHERE


def capsule(axes: Axes, a: NDArray, b: NDArray, radius: float, view: tuple[int, int], **style: object) -> None:
    """A capsule's outline along one axis of the world.

    Args:
        view: axes of the world to the right and up.
    """
    one, other = a[list(view)], b[list(view)]
    way = other - one
    turn = np.arctan2(way[1], way[0])
    half = np.linspace(-np.pi / 2, np.pi / 2, 16) + turn
    cap = radius * np.stack([np.cos(half), np.sin(half)], axis=1)
    axes.add_patch(Polygon(np.concatenate([other + cap, one - cap]), **style))  # pyright: ignore[reportArgumentType]  # a style


def obstacles(axes: Axes, case: Mapping[str, NDArray], view: tuple[int, int], **style: object) -> None:
    """All obstacles of a moment."""
    for kind, center, size, yaw in zip(case["kind"], case["center"], case["size"], case["yaw"], strict=True):
        x, y = center[list(view)]
        if kind == SPHERE or (kind == COLUMN and view == (0, 1)):
            axes.add_patch(Circle((x, y), size[0], **style))  # pyright: ignore[reportArgumentType]  # a style
            continue
        half = np.array([size[0], size[0], size[2]]) if kind == COLUMN else size
        turn = np.array([[np.cos(yaw), -np.sin(yaw), 0], [np.sin(yaw), np.cos(yaw), 0], [0, 0, 1]])
        turn = np.eye(3) if kind == COLUMN else turn
        corners = np.array([[i, j, k] for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)]) * half @ turn.T
        flat = corners[:, list(view)]
        if view == (0, 1):
            flat = flat[[0, 2, 6, 4]]
        else:
            low, high = flat.min(axis=0), flat.max(axis=0)
            flat = np.array([low, [high[0], low[1]], high, [low[0], high[1]]])
        axes.add_patch(Polygon(flat + np.array([x, y]), **style))  # pyright: ignore[reportArgumentType]  # a style
