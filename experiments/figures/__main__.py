"""`python -m experiments.figures RUN`: all figures of a finished run, as PNG in its folder."""

import sys
from collections.abc import Sequence
from pathlib import Path

import tyro

from hrcjax.lab.errors import UsageError, exit_status
from hrcjax.lab.options import parse_options
from hrcjax.sweeps.figures import draw_run
from hrcjax.sweeps.store import newest_run


def main(argv: Sequence[str] | None = None) -> int:
    """The program; returns its exit status."""

    def program() -> int:
        def figures(run: tyro.conf.Positional[Path | None] = None, by: str = "", metric: tuple[str, ...] = ()) -> int:
            """Draw the figures of a finished run into its folder.

            Args:
                run: Folder of the run; the newest one under runs/ if not given.
                by: Metric for ranking the settings, such as score_sound or score_overall (the Robotica paper's); that of the run if not given.
                metric: Metrics to draw as heat maps in addition to that one and those of the Pareto front, such as sound_separation energy.
            """
            folder = run or newest_run()
            if folder is None:
                raise UsageError("no finished run under runs/; name its folder")
            for path in draw_run(folder, by, metric):
                print(path)
            return 0

        return parse_options(figures, argv, "python -m experiments.figures")

    return exit_status(program, "stopped")


if __name__ == "__main__":
    sys.exit(main())
