"""Rows of two runs side by side: the ratio of each, worst first."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from hrcjax.lab.table import aligned

from .about import ABOUT, differences
from .bars import BARS
from .page import number

Row = Mapping[str, Any]
Results = Mapping[str, Mapping[str, Row]]

LOWER = ("s", "ms", "us", "ns", "MB", "GB", "m")
"""Units of which less is better: times, memory, errors. Of what is per second more is better."""
WORDS = {"low": "lower", "high": "higher", "": "-"}


@dataclass(frozen=True)
class Change:
    """A row of both runs."""

    section: str
    name: str
    before: float
    now: float
    better: str
    """"low" or "high"; "": neither."""

    @property
    def ratio(self) -> float:
        """Now over before; 1 if both are 0 [1]."""
        if self.before == self.now:
            return 1.0
        return self.now / self.before if self.before else math.copysign(math.inf, self.now)

    @property
    def badness(self) -> tuple[int, float]:
        """Larger is worse. Rows without direction come after all others, those that changed most first."""
        lost, found = not math.isfinite(self.now), not math.isfinite(self.before)
        if lost or found:
            return 1, math.inf * (lost - found) if lost != found else 0.0
        log = math.log(self.ratio) if 0 < self.ratio < math.inf else math.copysign(math.inf, self.ratio - 1)
        return (1, log if self.better == "low" else -log) if self.better else (0, abs(log))


def better(section: str, name: str, *rows: Row) -> str:
    """Whether "low" or "high" values are better: as a row says, else by its target, else by its unit; "": neither."""
    for row in rows:
        if "better" in row:
            return str(row["better"])
    sign = BARS.get(section, {}).get(name, ("",))[0]
    if sign:
        return "low" if sign.startswith("<") else "high"
    if name.startswith("ratio_to_"):  # to a peer: how many times faster
        return "high"
    words = str(rows[0].get("unit", "")).replace(",", " ").split()
    unit = words[0] if words else ""
    return "high" if unit.endswith("/s") else "low" if unit in LOWER else ""


def changes(before: Results, now: Results) -> list[Change]:
    """The rows of both, worst first."""
    found = [
        Change(section, name, float(old[name]["value"]), float(row["value"]), better(section, name, row, old[name]))
        for section, rows in now.items()
        if section != ABOUT and (old := before.get(section))
        for name, row in rows.items()
        if name in old
    ]
    return sorted(found, key=lambda change: change.badness, reverse=True)


def only(first: Results, second: Results) -> list[str]:
    """Sections and rows of the first that the second lacks."""
    found = []
    for section, rows in first.items():
        if section == ABOUT:
            continue
        if section not in second:
            found.append(f"{section} (all rows)")
            continue
        found += [f"{section}.{name}" for name in rows if name not in second[section]]
    return found


def comparison(before: Results, now: Results) -> str:
    """The table of all rows of both, what differs between the machines, and the rows that only one of them has."""
    rows = changes(before, now)
    compared = list(dict.fromkeys(change.section for change in rows))
    lines = [line] if (line := differences(before.get(ABOUT, {}), now.get(ABOUT, {}), compared)) else []
    head = ["section", "row", "before", "now", "now/before", "better"]
    cells = [[c.section, c.name, number(c.before), number(c.now), f"{c.ratio:.3f}", WORDS[c.better]] for c in rows]
    lines.append(aligned([head, *cells], "<<>>><") if cells else "no row is in both")
    for label, missing in (("before", only(before, now)), ("now", only(now, before))):
        if missing:
            lines.append(f"only {label}: {', '.join(missing)}")
    return "\n".join(lines)
