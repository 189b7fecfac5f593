"""Tables as aligned text."""

from collections.abc import Sequence


def aligned(rows: Sequence[Sequence[str]], align: str = "<") -> str:
    """Rows of cells as lines with aligned columns, two spaces apart.

    Args:
        rows: all of the same length.
        align: "<" left or ">" right for each column; the last one also applies to all further columns.
    """
    sides = [align[min(i, len(align) - 1)] for i in range(len(rows[0]) if rows else 0)]
    widths = [max(len(row[i]) for row in rows) for i in range(len(sides))]
    lines = ("  ".join(f"{cell:{side}{width}}" for cell, side, width in zip(row, sides, widths, strict=True)) for row in rows)  # fmt: skip
    return "\n".join(line.rstrip() for line in lines)
