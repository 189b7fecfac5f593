"""`python -m experiments.sweep`: runs the whole system for many settings of its parameters."""

import sys
from collections.abc import Sequence

from hrcjax.lab.compiled import keep_compiled
from hrcjax.lab.errors import exit_status
from hrcjax.sweeps.hosts import end_together

from .config import parse
from .run import run


def main(argv: Sequence[str] | None = None) -> int:
    """The program; returns its exit status."""

    def program() -> int:
        config = parse(sys.argv[1:] if argv is None else argv)
        keep_compiled()
        return run(config)

    return end_together(lambda: exit_status(program))


if __name__ == "__main__":
    sys.exit(main())
