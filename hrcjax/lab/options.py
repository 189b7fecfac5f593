"""Parses command-line options, with errors in one line."""

import contextlib
import io
import sys
from collections.abc import Callable, Sequence
from typing import Any, TypeVar

import tyro

from hrcjax.lab.errors import UsageError

T = TypeVar("T")


def _plain(box: str) -> str:
    """The message in the parser's error box, without its title and help excerpts."""
    lines = [line.strip("│╰╯ ") for line in box.strip().splitlines()[1:]]  # the first one is the title
    words = " ".join(" ".join(line for line in lines if line.strip("─-")).split())
    message = words.split(" For full helptext")[0].split(" Argument helptext:")[0]
    message, _, meant = message.partition(" Perhaps you meant:")
    close = [word for word in meant.split() if word.startswith("--")]
    return (message + (f"; close: {close[0].rstrip(',')}" if close else "")).rstrip(". ") or "invalid options"


def parse_options(kind: Callable[..., T], argv: Sequence[str] | None, program: str, **settings: Any) -> T:
    """`kind`, a dataclass or a function, called with the options of the command line.

    Raises:
        UsageError: an unknown option, a missing one, or a value of the wrong type.
        SystemExit: with status 0 after --help.
    """
    words = [
        word.partition("=")[0].replace("_", "-")
        for word in (sys.argv[1:] if argv is None else argv)
        if word.startswith("--")
    ]
    for word in words:
        if words.count(word) > 1:
            raise UsageError(f"{word} is given twice; give all its values after one {word}")
    printed = io.StringIO()
    try:
        with contextlib.redirect_stderr(printed):
            return tyro.cli(kind, prog=program, args=None if argv is None else list(argv), **settings)
    except SystemExit as stop:
        if not stop.code:
            raise
        raise UsageError(f"{_plain(printed.getvalue())}; --help shows all") from None
