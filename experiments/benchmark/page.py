"""The page of the benchmarks: every section's docstring, its rows, and their targets."""

import ast
import math
import operator
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

Row = Mapping[str, Any]

INTRODUCTION = """# Benchmarks

Written by the program; do not edit. `make benchmark` measures all sections, rewrites [benchmarks.json](benchmarks.json) and
this page. The page alone, from existing rows:

```
python -m experiments.benchmark page --json docs/benchmarks.json --page docs/benchmarks.md
```

Each section compares with a named peer, measured in the same process, without compile time. On a shared machine ratios vary by
some 20 % from run to run. Rows without a target are for information.
"""
MODULES = {"map": ("map", "map_queries")}
"""Section -> files whose docstrings describe it, if not only its own."""
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
    "scale": {"results_peak_mb": ("<", 2147.0), "figures_peak_mb": ("<", 2147.0)},
}
"""Section -> row -> target of its value."""


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


def section_page(section: str, rows: Mapping[str, Row]) -> str:
    """A section: its description and the table of its rows."""
    lines = [f"## {section}", "", *([description(section), ""] if description(section) else [])]
    lines += ["| row | measured | unit | target | met |", "|---|---|---|---|---|"]
    for name, row in rows.items():
        value, (sign, bar) = float(row["value"]), BARS.get(section, {}).get(name, ("", 0.0))
        held = ("yes" if COMPARE[sign](value, bar) else "**no**") if sign else "-"
        limit = f"{sign} {bar:g}" if sign else "-"
        lines.append(f"| {name} | {number(value)} | {row['unit']} | {limit} | {held} |")
    return "\n".join(lines) + "\n"


def page(results: Mapping[str, Mapping[str, Row]]) -> str:
    """The whole page, as Markdown."""
    return "\n".join([INTRODUCTION, *(section_page(section, rows) for section, rows in results.items())])
