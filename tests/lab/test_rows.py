"""Rows of figures as an aligned table, and sections of them in a file."""

import math
from pathlib import Path

import pytest

from hrcjax.lab.errors import UsageError
from hrcjax.lab.rows import read_results, table


def test_table_is_aligned() -> None:
    rows = {"arm steps": {"value": 1234567.8, "unit": "steps/s"}, "ratio": {"value": 2.345, "unit": "x mjx"}}
    lines = table("arm", rows).splitlines()
    assert lines == ["arm", "arm steps  1,234,568  steps/s", "ratio           2.35  x mjx"]


def test_numbers_that_are_not_finite_are_shown_as_such() -> None:
    assert table("a", {"b": {"value": math.inf, "unit": "m"}}).splitlines()[1] == "b  inf  m"


def test_sections_of_a_file(tmp_path: Path) -> None:
    file = tmp_path / "b.json"
    assert read_results(file) == {}
    file.write_text("")  # as mktemp makes it
    assert read_results(file) == {}
    file.write_text('{"arm": {"old": {"value": 1, "unit": "s"}}}')
    assert read_results(file) == {"arm": {"old": {"value": 1, "unit": "s"}}}


@pytest.mark.parametrize(("text", "message"), [("{", "is not valid JSON"), ("[]", "has no benchmark sections")])
def test_other_files_are_refused(text: str, message: str, tmp_path: Path) -> None:
    (tmp_path / "b.json").write_text(text)
    with pytest.raises(UsageError, match=message):
        read_results(tmp_path / "b.json")
