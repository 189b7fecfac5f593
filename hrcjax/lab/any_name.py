"""Names of files as text: a file system allows bytes that are no text, and characters that mean something elsewhere."""

import sys
import warnings


def printable(text: str) -> str:
    r"""Bytes that are no text (Python carries them as lone surrogates) in the form \xe4; all else as it is."""
    return text.encode(errors="surrogateescape").decode(errors="backslashreplace")


def title(text: str) -> str:
    """A name within the title of a figure, where dollars would begin mathematics."""
    return printable(text).replace("$", r"\$")


def print_any_name() -> None:
    """Lets stdout and stderr print every text: what their encoding lacks in the form \\xe4 or \\u4e2d.

    Figures show a box for a character that their font lacks; nobody is warned of that.
    """
    warnings.filterwarnings("ignore", message=r"Glyph \d+ .* missing from")
    for stream in (sys.stdout, sys.stderr):
        reconfigure = getattr(stream, "reconfigure", None)
        if reconfigure is not None:
            reconfigure(errors="backslashreplace")
