"""One claim of a paper: what became of it, by which figure, and the command that decides."""

import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

REPRODUCED, REFUTED, UNDECIDABLE, OPEN = "reproduced", "refuted", "not decidable", "open"
PROGRAM = "python -m experiments.reproduce"
TESTS = "python -m pytest "
DOCS = Path(__file__).resolve().parents[2] / "docs"
"""Pages of a checkout, whose measured figures are quoted; an installed package has none."""

Rows = Mapping[str, Mapping[str, Any]]


class Claim(NamedTuple):
    """One claim."""

    where: str
    """Section or table of the paper."""
    text: str
    """What it says, in short."""
    verdict: str
    why: Callable[[Rows], str]
    """The figure, from the rows of a run."""
    command: str
    """What decides it."""


def value(rows: Rows, name: str, digits: int = 2) -> str:
    """A row's value as text; "?" if the run has no such row."""
    return f"{rows[name]['value']:.{digits}f}" if name in rows else "?"


def cited(page: str, name: str, section: str = "") -> str:
    """The value of a row in a table of a page of the docs, as written there, below a heading if given; "?" if there is none."""
    path = DOCS / page
    text = path.read_text(encoding="utf-8") if path.exists() else ""
    below = text.partition(f"\n## {section}\n")[2] if section else text
    found = re.search(rf"^\| {re.escape(name)} \| ([^|]*?) \|", below, re.MULTILINE)
    return found.group(1) if found else "?"


def said(text: str) -> Callable[[Rows], str]:
    """The same whatever the rows; `{PAGE:ROW}` and `{PAGE#SECTION:ROW}` become figures of the docs."""
    pattern = r"\{([\w-]+\.md)(?:#([\w ]+))?:([\w.]+)\}"
    return lambda rows: re.sub(pattern, lambda m: cited(m.group(1), m.group(3), m.group(2) or ""), text)


def of(text: str) -> Callable[[Rows], str]:
    """`{ROW}` and `{ROW:DIGITS}` become values of the run."""
    return lambda rows: re.sub(r"\{(\w+)(?::(\d))?\}", lambda m: value(rows, m.group(1), int(m.group(2) or 2)), text)
