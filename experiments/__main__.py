"""`python -m experiments NAME ...`, installed `hrcjax NAME ...`: runs a program by name; without a name lists them all."""

import importlib
import sys
from collections.abc import Sequence
from pathlib import Path


def programs() -> dict[str, str]:
    """Name of every program -> first sentence of its package's docstring."""
    found = {}
    for entry in sorted(Path(__file__).parent.glob("*/__main__.py")):
        doc = importlib.import_module(f"{__package__}.{entry.parent.name}").__doc__ or ""
        found[entry.parent.name] = " ".join(doc.split(":")[0].split()).rstrip(".")
    return found


def main(argv: Sequence[str] | None = None) -> int:
    """Runs the program named by the first argument; returns its exit status."""
    words = list(sys.argv[1:] if argv is None else argv)
    known = programs()
    name = words[0] if words else "--help"
    if name in known:
        return importlib.import_module(f"{__package__}.{name}.__main__").main(words[1:])
    listed = "\n".join(f"  {program.ljust(max(map(len, known)))}  {text}" for program, text in known.items())
    if name in ("-h", "--help"):
        print(f"usage: hrcjax PROGRAM [OPTIONS]; hrcjax PROGRAM --help explains them\n\n{listed}")
        return 0
    print(f"error: no program {name!r}; accepted: {', '.join(known)}", file=sys.stderr)
    return 2


if __name__ == "__main__":
    sys.exit(main())
