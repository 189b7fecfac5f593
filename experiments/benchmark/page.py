"""The page of the benchmarks: every section's docstring, its rows, and their targets."""

import ast
import math
import operator
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from .about import ABOUT, sentence
from .bars import BARS
from .costliest import paragraph

Row = Mapping[str, Any]

INTRODUCTION = """# Benchmarks

Written by the program; do not edit. `make benchmark` measures all sections, rewrites [benchmarks.json](benchmarks.json) and
this page. The page alone, from existing rows:

```
python -m experiments.benchmark page --json docs/benchmarks.json --page docs/benchmarks.md
```

A run is compared with an earlier one, row by row, worst first, by `--against FILE`, or two files without measuring:

```
python -m experiments.benchmark compare --json NEW.json --against OLD.json
```

Peers are measured in the same process. Compile time stands apart, and no other row contains it. On a shared machine ratios vary
by some 20 % from run to run. Rows without a target are for information.
"""
MODULES = {"map": ("map", "map_queries")}
"""Section -> files whose docstrings describe it, if not only its own."""
COMPARE: dict[str, Callable[[float, float], bool]] = {"<": operator.lt, "<=": operator.le, ">=": operator.ge}


def number(value: float) -> str:
    """A number with three significant digits, or all digits of a large one."""
    if not math.isfinite(value):
        return str(value)
    return f"{value:,.0f}" if abs(value) >= 1000 else f"{value:.3g}"


def description(section: str) -> str:
    """The docstrings of a section's files; empty if it has none."""
    files = [Path(__file__).parent / f"{name}.py" for name in MODULES.get(section, (section,))]
    texts = [ast.get_docstring(ast.parse(f.read_text(encoding="utf-8"))) for f in files if f.is_file()]
    return "\n\n".join(text for text in texts if text)


def table(section: str, rows: Mapping[str, Row]) -> list[str]:
    """Rows with their targets, as lines of Markdown."""
    lines = ["| row | measured | unit | target | met |", "|---|---|---|---|---|"]
    for name, row in rows.items():
        value, (sign, bar) = float(row["value"]), BARS.get(section, {}).get(name, ("", 0.0))
        held = ("yes" if COMPARE[sign](value, bar) else "**no**") if sign else "-"
        limit = f"{sign} {bar:g}" if sign else "-"
        lines.append(f"| {name} | {number(value)} | {row['unit']} | {limit} | {held} |")
    return lines


def section_page(section: str, rows: Mapping[str, Row], known: Mapping[str, Any] | None = None) -> str:
    """A section: its description, the table of its rows, and that of compile times.

    Args:
        known: the machine that it was measured on.
    """
    compiled = {name: row for name, row in rows.items() if "compile" in name}
    run = {name: row for name, row in rows.items() if name not in compiled}
    blocks = [f"## {section}", description(section), sentence(known)]
    if run:
        blocks.append("\n".join(table(section, run)))
    if compiled:
        blocks += ["Compile time:", "\n".join(table(section, compiled))]
    if section == "loop":
        blocks.append(paragraph(rows))
    return "\n\n".join(block for block in blocks if block) + "\n"


def page(results: Mapping[str, Mapping[str, Any]]) -> str:
    """The whole page, as Markdown."""
    about = results.get(ABOUT, {})
    sections = [section_page(name, rows, about.get(name)) for name, rows in results.items() if name != ABOUT]
    return "\n".join([INTRODUCTION, *sections])
