"""One claim of a paper: what became of it, by which figure, and the command that decides."""

import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

REPRODUCED, PARTLY, MISSED = "reproduced", "partly", "not reproduced"
REFUTED, UNDECIDABLE, OPEN = "refuted", "not decidable", "open"
NOT_COMPUTED = "not computed in this run"
VERDICTS = (REPRODUCED, PARTLY, MISSED, REFUTED, UNDECIDABLE, OPEN, NOT_COMPUTED)
PROGRAM = "python -m experiments.reproduce"
TESTS = "python -m pytest "
DOCS = Path(__file__).resolve().parents[2] / "docs"
"""Pages of a checkout, whose measured figures are quoted; an installed package has none."""

Rows = Mapping[str, Mapping[str, Any]]


def cited(page: str, name: str, section: str = "") -> str:
    """The value of a row in a table of a page of the docs, as written there, below a heading if given; of a name that ends in * the
    largest of the rows that begin so.

    Raises:
        KeyError: there is none.
    """
    path = DOCS / page
    text = path.read_text(encoding="utf-8") if path.exists() else ""
    below = text.partition(f"\n## {section}\n")[2] if section else text
    pattern = re.escape(name.removesuffix("*")) + (r"[^| ]*" if name.endswith("*") else "")
    found = re.findall(rf"^\| {pattern} \| ([^|]*?) \|", below, re.MULTILINE)
    if not found:
        raise KeyError(f"{page}:{name}")
    return max(found, key=_number) if name.endswith("*") else found[0]


def _number(text: str) -> float:
    return float(text.replace(",", ""))


class Figures:
    """Numbers by name: a row of a run, ROW, or of a page of the docs, PAGE.md:ROW or PAGE.md#SECTION:ROW."""

    def __init__(self, rows: Rows) -> None:
        self.rows = rows

    def text(self, name: str, digits: int = 2) -> str:
        """A number as text: with that many digits, or as its page has it.

        Raises:
            KeyError: there is none.
        """
        page, colon, row = name.partition(":")
        if colon:
            file, _, section = page.partition("#")
            return cited(file, row, section)
        return f"{round(self.rows[name]['value'], digits) + 0.0:.{digits}f}"  # no minus before 0.00

    def __getitem__(self, name: str) -> float:
        return _number(self.text(name)) if ":" in name else float(self.rows[name]["value"])


Rule = Callable[[Figures], str]
"""The verdict by the figures; KeyError if one is missing."""


class Claim(NamedTuple):
    """One claim."""

    where: str
    """Section or table of the paper."""
    text: str
    """What it says, in short."""
    verdict: str | Rule
    """Fixed where no figure decides."""
    why: Callable[[Figures], str]
    """The figure."""
    command: str
    """What decides it."""

    def judged(self, rows: Rows) -> tuple[str, str]:
        """Verdict and figure by the rows of a run."""
        figures = Figures(rows)
        try:
            return (self.verdict if isinstance(self.verdict, str) else self.verdict(figures)), self.why(figures)
        except KeyError:
            return (self.verdict if isinstance(self.verdict, str) else NOT_COMPUTED), "-"


def said(text: str) -> Callable[[Figures], str]:
    """A sentence with figures: `{ROW}` and `{ROW:DIGITS}` of the run, `{PAGE.md:ROW}` and `{PAGE.md#SECTION:ROW}` of the docs."""
    pattern = r"\{([\w-]+\.md(?:#[\w ]+)?:[\w.]+\*?|\w+)(?::(\d))?\}"
    return lambda figures: re.sub(pattern, lambda m: figures.text(m.group(1), int(m.group(2) or 2)), text)
