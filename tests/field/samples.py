"""Sampled surfaces whose distance is known in closed form, as float64 NumPy arrays [m]."""

import jax.numpy as jnp
import numpy as np

from hrcjax.geom.cloud import Cloud


def sphere(count: int, radius: float, centre=(0.0, 0.0, 0.0)) -> np.ndarray:
    """A spiral of nearly even spacing."""
    i = np.arange(count) + 0.5
    polar, azimuth = np.arccos(1 - 2 * i / count), np.pi * (1 + 5**0.5) * i
    unit = np.stack([np.cos(azimuth) * np.sin(polar), np.sin(azimuth) * np.sin(polar), np.cos(polar)], axis=1)
    return radius * unit + np.asarray(centre)


def plane(half: int, spacing: float) -> np.ndarray:
    """A square grid in z = 0 about the origin."""
    a, b = np.meshgrid(*2 * [np.arange(-half, half + 1) * spacing])
    return np.stack([a.ravel(), b.ravel(), 0 * a.ravel()], axis=1)


def cylinder(radius: float, spacing: float, half_length: float) -> np.ndarray:
    """Rings about z, with a point at azimuth 0 in each."""
    azimuth = np.arange(int(2 * np.pi * radius / spacing)) * 2 * np.pi / int(2 * np.pi * radius / spacing)
    a, z = np.meshgrid(azimuth, np.arange(-half_length, half_length + spacing / 2, spacing))
    return np.stack([radius * np.cos(a).ravel(), radius * np.sin(a).ravel(), z.ravel()], axis=1)


def cloud(points: np.ndarray, dtype=np.float64, missing: int = 0) -> Cloud:
    """A cloud with some slots that hold no point, first and last, at places where a point would matter."""
    fill = np.full((missing, 3), 0.07)
    points = np.concatenate([fill, points, fill])
    mask = np.ones(len(points), bool)
    mask[:missing] = False
    mask[len(points) - missing :] = False
    return Cloud(jnp.asarray(points, dtype), jnp.asarray(mask))
