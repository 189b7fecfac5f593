"""`python -m experiments.pointing`: places chosen by pointing."""

import sys
from collections.abc import Sequence

from hrcjax.lab.compiled import keep_compiled
from hrcjax.lab.errors import exit_status

from .config import parse


def main(argv: Sequence[str] | None = None) -> int:
    """The program; returns its exit status."""

    def program() -> int:
        config = parse(sys.argv[1:] if argv is None else argv)
        keep_compiled()
        from .run import run  # here, so that --help and wrong options answer at once

        return run(config)

    return exit_status(program)


if __name__ == "__main__":
    sys.exit(main())
