"""Points of exact shapes, spread evenly, with their normals."""

import numpy as np
from numpy.typing import NDArray

SPACING = 0.006


def sphere(radius: float, spacing: float = SPACING) -> tuple[NDArray, NDArray]:
    """A Fibonacci lattice."""
    count = int(4 * np.pi * radius**2 / spacing**2)
    k = np.arange(count) + 0.5
    z, turn = 1 - 2 * k / count, np.pi * (1 + 5**0.5) * k
    n = np.column_stack([np.sqrt(1 - z * z) * np.cos(turn), np.sqrt(1 - z * z) * np.sin(turn), z])
    return radius * n, n


def box(half: tuple[float, float, float], spacing: float = SPACING) -> tuple[NDArray, NDArray]:
    """Middles of squares on all faces."""
    points, normals = [], []
    for axis in range(3):
        a, b = [k for k in range(3) if k != axis]
        grids = [-half[k] + (np.arange(round(2 * half[k] / spacing)) + 0.5) * spacing for k in (a, b)]
        u, v = (g.ravel() for g in np.meshgrid(*grids))
        for side in (-1.0, 1.0):
            p, n = np.zeros((len(u), 3)), np.zeros((len(u), 3))
            p[:, axis], p[:, a], p[:, b], n[:, axis] = side * half[axis], u, v, side
            points.append(p)
            normals.append(n)
    return np.concatenate(points), np.concatenate(normals)


def cylinder(radius: float, half: float, spacing: float = SPACING) -> tuple[NDArray, NDArray]:
    """The mantle alone, rows turned against each other."""
    around = round(2 * np.pi * radius / spacing)
    rows = round(2 * half / spacing)
    k, j = (g.ravel() for g in np.meshgrid(np.arange(around), np.arange(rows)))
    angle = 2 * np.pi * (k + 0.5 * (j % 2)) / around
    n = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(len(angle))])
    return radius * n + np.column_stack([0 * angle, 0 * angle, -half + (j + 0.5) * spacing]), n
