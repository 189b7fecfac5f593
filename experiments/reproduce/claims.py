"""The page of every claim of both papers."""

from collections import Counter

from .claim import VERDICTS, Rows
from .hri_claims import HRI
from .robotica_claims import ROBOTICA


def counts(rows: Rows) -> dict[str, int]:
    """How many claims have each verdict."""
    found = Counter(claim.judged(rows)[0] for claim in (*ROBOTICA, *HRI))
    return {verdict: found[verdict] for verdict in VERDICTS if found[verdict]}


def claims_page(rows: Rows, command: str) -> str:
    """The page of all claims, as Markdown."""
    told = ", ".join(f"{count} {verdict}" for verdict, count in counts(rows).items())
    text = f"""# The papers' claims

Written by the program; do not edit.

```
{command}
```

{told}. *Reproduced*: the same within what the paper's digits and this page say. *Partly*: some of it is, and the figure says which; the rest is not measured or
differs. *Not reproduced*: tried here, and missed. *Refuted*: a measurement, or the paper's own numbers, say
otherwise. *Not decidable*: by what is published. *Open*: nothing here decides yet; the comparison it needs is named. Where figures decide, the verdict follows from
them by a rule (`experiments/reproduce/rules.py`). Times to goal assume unit steps of 1/30 s and arrival at 1 cm, both inferred
([reproduce.md](reproduce.md)). Figures of other pages are quoted from them.
"""
    for title, some in (
        ("Robotica 2025: potential field, paths, zones, score", ROBOTICA),
        ("HRI 2025: distance fields and motion policies (abstract and project page)", HRI),
    ):
        text += f"\n## {title}\n\n| where | claim | verdict | figure | decided by |\n|---|---|---|---|---|\n"
        for claim in some:
            decided = claim.command if claim.command == "-" else f"`{claim.command}`"
            verdict, figure = claim.judged(rows)
            text += f"| {claim.where} | {claim.text} | **{verdict}** | {figure} | {decided} |\n"
    return text
