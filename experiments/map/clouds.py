"""Point clouds prepared on the host: padded, rotated to the faces of a cube, with their point spacing estimated."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import KDTree

from hrcjax.io.recordings.frame import InputFrame
from hrcjax.map import FACES, tiles_along

LEAST_PLACES = 1024
"""Capacity of the smallest padded cloud."""
ASKED = 1000
"""Points from whose nearest neighbours the spacing of a cloud is estimated."""
GAPS = (0.005, 0.3)
"""Smallest and largest accepted estimate of the spacing [m]."""


@dataclass(frozen=True, eq=False)
class Look:
    """A virtual pinhole camera, and the cloud in its axes."""

    rotation: np.ndarray
    """World from camera, (3, 3)."""
    position: np.ndarray
    """Position of the pinhole (3,) [m]."""
    cloud: np.ndarray
    """Padded points in the camera's axes, (place, 3) [m]."""
    mask: np.ndarray
    """True for points, False for padding, (place,)."""
    tiles: int
    """Tiles along each edge of the image."""


def places_for(points: int) -> int:
    """Capacity for a cloud: a power of two, so that few programs are compiled."""
    return max(LEAST_PLACES, 1 << max(points - 1, 0).bit_length())


def gap_of(cloud: np.ndarray) -> float:
    """Spacing of the points of one surface [m]: twice the 95th percentile of the nearest-neighbour distance."""
    if len(cloud) < 2:
        return GAPS[1]
    asked = cloud[:: max(1, len(cloud) // ASKED)]
    distance = KDTree(cloud).query(asked, k=2)[0][:, 1]
    return float(np.clip(2 * np.quantile(distance, 0.95), *GAPS))


def looks_at(frame: InputFrame, places: int) -> list[Look]:
    """A virtual camera for each face of a cube around the sensor that has points in its view."""
    assert frame.cloud is not None
    tiles, looks = tiles_along(places), []
    for face in FACES:
        cloud = np.asarray(frame.cloud @ face, np.float32)
        ahead = cloud[:, 2] > 0
        if not (ahead & (np.abs(cloud[:, :2]).max(axis=1) <= cloud[:, 2])).any():
            continue
        looks.append(Look(frame.rotation @ face, frame.position, *_padded(cloud[ahead], places), tiles))
    return looks


def look_from_afar(frame: InputFrame, places: int) -> tuple[Look, float]:
    """One virtual camera outside of a cloud whose sensor position is unknown, and its largest depth [m]."""
    assert frame.cloud is not None
    cloud = np.asarray(frame.cloud, np.float64)
    low, high = cloud.min(axis=0), cloud.max(axis=0)
    radius = max(float(np.linalg.norm(high - low)) / 2, 0.5)
    eye = (low + high) / 2 - [0.0, 0.0, 2 * radius]
    position = frame.rotation @ eye + frame.position
    padded = _padded(np.asarray(cloud - eye, np.float32), places)
    return Look(frame.rotation, position, *padded, tiles_along(places)), 4 * radius


def _padded(cloud: np.ndarray, places: int) -> tuple[np.ndarray, np.ndarray]:
    points = np.zeros((places, 3), np.float32)
    points[: len(cloud)] = cloud
    return points, np.arange(places) < len(cloud)
