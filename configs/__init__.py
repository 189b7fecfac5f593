"""Named, documented settings of the programs."""

from configs import paper_sweep, people_sweep, quick_sweep
from configs.sweep_config import SweepConfig

CONFIGS: dict[str, SweepConfig] = {
    "paper": paper_sweep.CONFIG,
    "quick": quick_sweep.CONFIG,
    "people": people_sweep.CONFIG,
}
"""The sweep's named settings."""

__all__ = ["CONFIGS", "SweepConfig"]
