"""File names as printable text: a file system allows bytes that are not valid text, and characters with a special meaning."""

import sys
import warnings


def printable(text: str) -> str:
    r"""Bytes that are not valid text (Python's lone surrogates) as \xe4; everything else unchanged."""
    return text.encode(errors="surrogateescape").decode(errors="backslashreplace")


def title(text: str) -> str:
    """A name for the title of a figure, with dollar signs escaped."""
    return printable(text).replace("$", r"\$")


def print_any_name() -> None:
    """Lets stdout and stderr print any text: characters outside their encoding as \\xe4 or \\u4e2d.

    Figures show a box for a character that is missing in their font, without a warning.
    """
    warnings.filterwarnings("ignore", message=r"Glyph \d+ .* missing from")
    for stream in (sys.stdout, sys.stderr):
        reconfigure = getattr(stream, "reconfigure", None)
        if reconfigure is not None:
            reconfigure(errors="backslashreplace")
