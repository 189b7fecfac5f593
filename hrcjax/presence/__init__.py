"""Where a person may be: what contradicts the settled picture of the cell, and what was lost from sight."""

from hrcjax.presence.background import Background, initial_background, learn_background, settled_depth
from hrcjax.presence.cloud import Presence, presence_cloud
from hrcjax.presence.params import PresenceParams
from hrcjax.presence.sight import Sight, least_around, seen_free, sight_of
from hrcjax.presence.track import Empty, Track, initial_track, survey_empty, update_track
from hrcjax.presence.voxels import (
    CELL_VOXELS,
    Columns,
    VoxelLayout,
    centres,
    grow,
    pack_columns,
    unpack_columns,
    voxel_of,
)

__all__ = [
    "CELL_VOXELS", "Background", "Columns", "Empty", "Presence", "PresenceParams", "Sight", "Track", "VoxelLayout", "centres",
    "grow", "initial_background", "initial_track", "learn_background", "least_around", "pack_columns", "presence_cloud", "seen_free",
    "settled_depth", "sight_of", "survey_empty", "unpack_columns", "update_track", "voxel_of",
]  # fmt: skip
