"""What a run of the sweep is, after its options were read."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hrcjax.sweeps.settings import Settings
from hrcjax.sweeps.sweepable import Sweepable


@dataclass(frozen=True)
class Job:
    """A problem, its settings and its folder."""

    problem: Sweepable
    settings: Settings
    chunk: int
    """Settings in a chunk."""
    mark: str
    """Fingerprint of everything that determines the results."""
    folder: Path
    record: dict[str, Any]
    """Content of config.json."""
    attrs: dict[str, Any]
    """Attributes of the results."""
