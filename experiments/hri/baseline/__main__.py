"""`python -m experiments.hri.baseline`: the baseline alone, in some scenes."""

import sys
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from hrcjax.cells.people import person_key
from hrcjax.lab.case_store import FIGURES, locked_store
from hrcjax.lab.compiled import keep_compiled
from hrcjax.lab.errors import UsageError, exit_status
from hrcjax.lab.options import parse_options
from hrcjax.lab.provenance import fingerprint, provenance

from . import octree, planning, timing
from .figures import save_run
from .settings import BaselineSettings
from .table import identity, kept_trace, rows, text

PARTS = {"pyoctomap": octree.installed(), "OMPL": planning.installed(), "toppra": timing.installed()}
"""Whether what the baseline is made of is there."""


@dataclass(frozen=True)
class Options:
    """Run the baseline of the HRI paper's experiment alone: a table of its measures and a figure of every run."""

    scene: str = "hri"
    """Scene: hri, robotica, clutter."""
    people: tuple[str, ...] = ("nobody", "reach_in", "reach_and_stay")
    """Motions of people, or BVH files."""
    seeds: tuple[int, ...] = (0, 3)
    """Seeds of people, noise and planner."""
    seconds: float = 12.0
    """Length of a run [s]."""
    out: Path | None = None
    """Folder of the runs, which are taken from there the next time, and of the figures; runs/hri-baseline-FINGERPRINT if not given."""
    settings: BaselineSettings = field(default_factory=BaselineSettings)
    """Numbers of the baseline."""


def main(argv: Sequence[str] | None = None) -> int:
    """The program; returns its exit status."""

    def program() -> int:
        options = parse_options(Options, argv, "python -m experiments.hri.baseline")
        missing = [name for name, there in PARTS.items() if not there]
        if missing:
            raise UsageError(f"{', '.join(missing)} not installed; pip install 'hrcjax[baselines]'")
        keep_compiled()
        mark = fingerprint(identity())
        folder = options.out or Path("runs") / f"hri-baseline-{mark[:8]}"
        about = {"program": "hri.baseline", **provenance()}
        run = (options.scene, options.people, options.seeds, options.seconds, options.settings)
        with locked_store(folder, mark, about, overwrite=False) as store:
            lines = rows(store, *run)
            print(text(lines))
            for person, seed, *_ in lines:
                trace = kept_trace(store, options.scene, person, int(seed), options.seconds, options.settings)
                save_run(trace, f"{person}, seed {seed}", folder / FIGURES / f"{person_key(person)}-{seed}.png")
        return 0

    return exit_status(program)


if __name__ == "__main__":
    sys.exit(main())
