"""Columns of text."""

from hrcjax.lab.table import aligned


def test_columns_are_as_wide_as_their_widest_cell() -> None:
    rows = [["name", "value", "unit"], ["a", "1.5", "m"], ["longer", "12345.0", ""]]
    assert aligned(rows).splitlines() == ["name    value    unit", "a       1.5      m", "longer  12345.0"]
    assert aligned(rows, "<><").splitlines()[1] == "a           1.5  m"
    assert aligned(rows, ">").splitlines() == ["  name    value  unit", "     a      1.5     m", "longer  12345.0"]
    assert aligned([]) == ""
