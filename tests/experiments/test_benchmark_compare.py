"""Two runs side by side: directions, ratios, the order of the table, machines."""

import math

import pytest

from experiments.benchmark.about import about, differences, sentence
from experiments.benchmark.compare import Change, better, changes, comparison
from experiments.benchmark.costliest import costliest, paragraph


def row(value: float, unit: str = "s", **more: str) -> dict:
    return {"value": value, "unit": unit, **more}


@pytest.mark.parametrize(
    ("section", "name", "unit", "expected"),
    [
        ("mine", "a", "s, slowest batch", "low"),
        ("mine", "a", "ms at 24802 points", "low"),
        ("mine", "a", "MB", "low"),
        ("mine", "a", "1/s", "high"),
        ("mine", "a", "steps/s, batch 64", "high"),
        ("mine", "a", "GFLOP/s", "high"),
        ("mine", "ratio_to_peer", "1", "high"),
        ("grad", "ratio_to_forward", "1", "low"),  # by its target
        ("map", "growth_ratio", "1", "low"),
        ("mine", "settings", "1", ""),
        ("mine", "a", "", ""),
    ],
)
def test_direction(section: str, name: str, unit: str, expected: str) -> None:
    assert better(section, name, row(1.0, unit)) == expected


def test_a_row_says_its_own_direction() -> None:
    assert better("grad", "ratio_to_forward", row(1.0, "1", better="high")) == "high"
    assert better("mine", "a", row(1.0), row(1.0, better="")) == ""


def test_worst_first_whatever_the_direction() -> None:
    before = {"a": {"t": row(2.0), "r": row(8.0, "1/s"), "same": row(1.0), "n": row(3.0, "1"), "quick": row(2.0)}}
    now = {"a": {"t": row(3.0), "r": row(4.0, "1/s"), "same": row(1.0), "n": row(30.0, "1"), "quick": row(1.0)}}
    found = changes(before, now)
    assert [(c.name, c.ratio) for c in found] == [("r", 0.5), ("t", 1.5), ("same", 1.0), ("quick", 0.5), ("n", 10.0)]


def test_values_that_have_no_ratio() -> None:
    """Zero, infinite and missing numbers: what is lost comes first, what is found last among those with a direction."""
    ways = {
        "lost": (1.0, math.nan),
        "grown": (0.0, 1.0),
        "worse": (1.0, 2.0),
        "none": (0.0, 0.0),
        "never": (math.nan,) * 2,
    }
    ways |= {"better": (2.0, 1.0), "vanished": (1.0, 0.0), "found": (math.inf, 1.0)}
    for direction in ("low", "high"):
        sides = [{"a": {n: row(v[k], better=direction) for n, v in ways.items()}} for k in (0, 1)]
        names = [c.name for c in changes(*sides)]
        assert names[0] == "lost" if direction == "low" else names[0] in ("lost", "vanished")
        assert (names.index("worse") < names.index("none") < names.index("better")) == (direction == "low")
        assert names.index("found") > names.index("none")
    assert Change("a", "n", 0.0, 0.0, "low").ratio == 1.0 and Change("a", "n", 0.0, 2.0, "low").ratio == math.inf


def test_rows_of_one_file_are_named() -> None:
    text = comparison({"a": {"x": row(1), "y": row(1)}, "b": {"z": row(1)}}, {"a": {"x": row(1)}, "c": {"z": row(1)}})
    assert "only before: a.y, b (all rows)" in text and "only now: c (all rows)" in text
    assert "no row is in both" in comparison({"a": {"x": row(1)}}, {"a": {"y": row(1)}})


def test_machines_that_differ_are_said_in_one_line_above_the_table() -> None:
    here = about(0.5)
    assert differences({"a": here}, {"a": {**here, "load_before": 9.0, "date": "later", "commit": "x"}}, ["a"]) == ""
    other = {**here, "cpu": "Abacus", "jax": "0.1"}
    files = ({"a": {"x": row(1)}, "b": {"x": row(1)}, "about": {"a": s, "b": here}} for s in (other, here))
    first, head, *_ = comparison(*files).splitlines()
    assert first.startswith("not the same machine or versions: cpu Abacus -> ") and "jax 0.1 -> " in first
    assert "(a)" in first and "(b)" not in first and head.startswith("section  row")
    assert "not recorded before (all)" in differences({}, {"a": here}, ["a"])
    assert here["cpu"] in sentence(here) and sentence(None) == "Machine and versions were not recorded."


def test_costliest_places() -> None:
    rows = {
        f"{name}_share": row(share, "1")
        for name, share in {"a": 0.1, "b": 0.4, "c": 0.2, "d": 0.05, "rest": 0.9}.items()
    }
    rows |= {f"b_{unit}_per_s": row(2.0) for unit in ("gflop", "gb")}
    rows |= {f"peak_{unit}_per_s": row(8.0) for unit in ("gflop", "gb")}
    assert costliest(rows) == ["b", "c", "a"]
    said = paragraph(rows)
    assert (
        "1. `b`: 40 % of the tick; 2 GFLOP/s, 25.0 % of the peak" in said and "0.25 times what the memory gives" in said
    )
    assert paragraph({}) == ""
