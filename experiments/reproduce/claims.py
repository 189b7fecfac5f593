"""The page of every claim of both papers."""

from .claim import OPEN, REFUTED, REPRODUCED, UNDECIDABLE, Rows
from .hri_claims import HRI
from .robotica_claims import ROBOTICA


def counts() -> dict[str, int]:
    """How many claims have each verdict."""
    return {
        verdict: sum(claim.verdict == verdict for claim in (*ROBOTICA, *HRI))
        for verdict in (REPRODUCED, REFUTED, UNDECIDABLE, OPEN)
    }


def claims_page(rows: Rows, command: str) -> str:
    """The page of all claims, as Markdown."""
    told = ", ".join(f"{count} {verdict}" for verdict, count in counts().items())
    text = f"""# The papers' claims

Written by the program; do not edit.

```
{command}
```

{told}. *Reproduced*: the same within what the paper's digits and this page say. *Refuted*: a measurement, or the paper's own numbers, say
otherwise. *Not decidable*: by what is published. *Open*: nothing here decides yet; the comparison it needs is named. Times to goal
assume unit steps of 1/30 s and arrival at 1 cm, both inferred ([reproduce.md](reproduce.md)). Figures of other pages are quoted from them; "?" stands for what the run did not compute.
"""
    for title, some in (
        ("Robotica 2025: potential field, paths, zones, score", ROBOTICA),
        ("HRI 2025: distance fields and motion policies (abstract and project page)", HRI),
    ):
        text += f"\n## {title}\n\n| where | claim | verdict | figure | decided by |\n|---|---|---|---|---|\n"
        for claim in some:
            decided = claim.command if claim.command == "-" else f"`{claim.command}`"
            text += f"| {claim.where} | {claim.text} | **{claim.verdict}** | {claim.why(rows)} | {decided} |\n"
    return text
