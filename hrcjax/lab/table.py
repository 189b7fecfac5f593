"""Aligned text of rows and columns."""

from collections.abc import Sequence


def aligned(rows: Sequence[Sequence[str]], align: str = "<") -> str:
    """Rows of texts, one below the other, in columns two blanks apart.

    Args:
        rows: all of the same length.
        align: for each column "<" left or ">" right; the last one also holds for the columns after it.
    """
    ways = [align[min(i, len(align) - 1)] for i in range(len(rows[0]) if rows else 0)]
    widths = [max(len(row[i]) for row in rows) for i in range(len(ways))]
    lines = ("  ".join(f"{cell:{way}{width}}" for cell, way, width in zip(row, ways, widths, strict=True)) for row in rows)  # fmt: skip
    return "\n".join(line.rstrip() for line in lines)
