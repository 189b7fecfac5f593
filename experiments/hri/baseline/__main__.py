"""`python -m experiments.hri.baseline`: the baseline alone, in some scenes."""

import sys
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from hrcjax.lab.compiled import keep_compiled
from hrcjax.lab.errors import UsageError, exit_status
from hrcjax.lab.options import parse_options

from . import octree, planning, timing
from .figures import save_run
from .settings import BaselineSettings
from .table import kept_trace, rows, text

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
    out: Path = Path("runs/hri-baseline")
    """Folder of the runs, which are taken from there the next time, and of the figures."""
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
        lines = rows(options.out, options.scene, options.people, options.seeds, options.seconds, options.settings)
        print(text(lines))
        for person, seed, *_ in lines:
            trace = kept_trace(options.out, options.scene, person, int(seed), options.seconds, options.settings)
            save_run(trace, f"{person}, seed {seed}", options.out / "figures" / f"{Path(person).stem}-{seed}.png")
        return 0

    return exit_status(program)


if __name__ == "__main__":
    sys.exit(main())
