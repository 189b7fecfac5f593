"""The page of the benchmarks: every section's docstring, its rows, and the bars that they are held against."""

import ast
import math
import operator
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

Row = Mapping[str, Any]

ABOUT = """# Benchmarks

Written by the program; do not edit. `make benchmark` measures all sections, rewrites [benchmarks.json](benchmarks.json) and
this page. The page alone, from rows that were measured before:

```
python -m experiments.benchmark page --json docs/benchmarks.json --page docs/benchmarks.md
```

Each section compares with a named peer, measured in the same process, compile time apart. On a shared machine ratios move by
some 20 % from run to run. A bar is what the project holds itself to; rows without one are for information.
"""
MODULES = {"map": ("map", "map_queries")}
"""Files whose docstrings tell what a section does, where it is more than the section's own."""
COMPARE: dict[str, Callable[[float, float], bool]] = {"<": operator.lt, "<=": operator.le, ">=": operator.ge}
BARS = {
    "arm": {
        "ratio_to_mujoco_rollout": (">=", 4.0),
        "ratio_to_mjx_step": (">=", 6.0),
        "compile_s": ("<", 10.0),
    },
    "field": {
        "value_ratio_to_exp": ("<=", 3.0),
        "value_grad_ratio_to_exp": ("<=", 6.0),
    },
    "grad": {"ratio_to_forward": ("<=", 5.0), "compile_s": ("<", 60.0)},
    "sweep": {"ratio_to_serial": (">=", 15.0)},
    "map": {
        "p95_ms": ("<", 33.0),
        "growth_ratio": ("<=", 1.25),
        "query_18_ms": ("<", 0.3),
        "query_ratio_to_exp": ("<=", 4.0),
    },
}
"""Section -> row -> what its value must be."""


def number(value: float) -> str:
    """Three digits, or all of a large number."""
    if not math.isfinite(value):
        return str(value)
    return f"{value:,.0f}" if abs(value) >= 1000 else f"{value:.3g}"


def about(section: str) -> str:
    """The docstrings of a section's files; empty if there are none."""
    files = [Path(__file__).parent / f"{name}.py" for name in MODULES.get(section, (section,))]
    texts = [ast.get_docstring(ast.parse(f.read_text(encoding="utf-8"))) for f in files if f.is_file()]
    return "\n\n".join(text for text in texts if text)


def section_page(section: str, rows: Mapping[str, Row]) -> str:
    """A section: what is measured, and the table of its rows."""
    lines = [f"## {section}", "", *([about(section), ""] if about(section) else [])]
    lines += ["| row | measured | unit | bar | held |", "|---|---|---|---|---|"]
    for name, row in rows.items():
        value, (sign, bar) = float(row["value"]), BARS.get(section, {}).get(name, ("", 0.0))
        held = ("yes" if COMPARE[sign](value, bar) else "**no**") if sign else "-"
        limit = f"{sign} {bar:g}" if sign else "-"
        lines.append(f"| {name} | {number(value)} | {row['unit']} | {limit} | {held} |")
    return "\n".join(lines) + "\n"


def page(results: Mapping[str, Mapping[str, Row]]) -> str:
    """The whole page, as Markdown."""
    return "\n".join([ABOUT, *(section_page(section, rows) for section, rows in results.items())])
