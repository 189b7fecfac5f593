"""Sections are found, shown, merged and compared; mistakes get one line."""

import json
import os
import re
import sys
import types
from pathlib import Path

import jax
import pytest

from experiments.benchmark.__main__ import SECTIONS, main
from experiments.benchmark.page import BARS, page

ROWS = {"arm steps": {"value": 1234567.8, "unit": "steps/s"}, "ratio": {"value": 2.345, "unit": "x mjx"}}


@pytest.fixture(autouse=True)
def sections(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in SECTIONS:
        module = types.ModuleType(name)
        module.run = lambda name=name: {**ROWS, name: {"value": 1, "unit": "s"}}  # pyright: ignore[reportAttributeAccessIssue]
        monkeypatch.setitem(sys.modules, f"experiments.benchmark.{name}", module)


def test_rows_are_merged_into_the_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "b.json"
    file.write_text(json.dumps({"arm": {"old": {"value": 1, "unit": "s"}}, "other": {}}))
    assert main(["arm", "--json", str(file)]) == 0
    found = json.loads(file.read_text())
    assert list(found) == ["arm", "other", "about"] and "old" not in found["arm"]
    known = found["about"]["arm"]
    assert known["cores"] == os.cpu_count() and known["jax"] == jax.__version__ and known["load_before"] >= 0
    assert {"cpu", "memory_gb", "device", "python", "jaxlib", "numpy", "mujoco", "date", "commit"} < set(known)
    assert found["arm"]["ratio"] == {"value": 2.345, "unit": "x mjx"}
    assert "1,234,568  steps/s" in capsys.readouterr().out
    assert main(["all", "--json", str(file)]) == 0
    found = json.loads(file.read_text())
    assert set(found) == {*SECTIONS, "other", "about"} and set(found["about"]) == set(SECTIONS)
    assert f"section sweep, 5 of {len(SECTIONS)}" in capsys.readouterr().err


def test_without_a_file_the_table_is_all(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["grad"]) == 0
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (
            ["legs"],
            "no section 'legs'; accepted: arm, field, grad, horizon, sweep, loop, tick, map, scale, plan, all, page, compare",
        ),
        ([], "Missing from python -m experiments.benchmark"),
        (["arm", "--jsn", "x"], "Unrecognized options: --jsn, x; close: --json"),
        (["arm", "--json", "none/b.json"], "no folder none"),
        (["arm", "--page", "none/b.md"], "no folder none for --page"),
        (["page", "--page", "b.md"], "section page needs --json FILE with the rows and --page"),
        (["page", "--page", "b.md", "--json", "new.json"], "holds no rows"),
        (["compare", "--json", "b.json"], "section compare needs --json FILE with the rows and --against"),
        (["compare", "--json", "new.json", "--against", "one.json"], "new.json holds no rows; measure first"),
        (["arm", "--against", "new.json"], "new.json holds no rows to compare with"),
        (["page", "--page", "b.md", "--json", "one.json", "--against", "one.json"], "section page compares nothing"),
        (["arm", "--json", "broken.json"], "is not valid JSON"),
        (["arm", "--json", "list.json"], "has no benchmark sections"),
    ],
)
def test_mistakes_get_one_line(
    options: list[str],
    message: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "broken.json").write_text("{")
    (tmp_path / "list.json").write_text("[]")
    (tmp_path / "one.json").write_text(json.dumps({"arm": ROWS}))
    assert main(options) == 2
    error = capsys.readouterr().err
    assert error.startswith("error: ") and message in error and error.count("\n") == 1


def test_a_section_that_is_not_there(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    def absent(name: str) -> None:
        raise ModuleNotFoundError(f"No module named {name!r}", name=name)

    monkeypatch.setattr("experiments.benchmark.__main__.importlib.import_module", absent)
    assert main(["arm"]) == 1
    assert "section arm, 1 of 1, failed after" in (said := capsys.readouterr().err)
    assert "it has no module experiments.benchmark.arm" in said


def test_a_section_that_fails_is_named_and_the_others_go_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def broken() -> None:
        raise FloatingPointError("too\nslow")

    monkeypatch.setattr(sys.modules["experiments.benchmark.grad"], "run", broken)
    file = tmp_path / "b.json"
    assert main(["all", "--json", str(file)]) == 1
    errors = [line for line in capsys.readouterr().err.splitlines() if line.startswith("error")]
    assert len(errors) == 1 and "section grad, 3 of 10, failed after" in errors[0] and errors[0].endswith(": too slow")
    assert set(json.loads(file.read_text())) == {*SECTIONS, "about"} - {"grad"}
    file.write_text(json.dumps({"grad": ROWS, "arm": ROWS, "other": ROWS}))
    assert main(["all", "--json", str(file), "--against", str(file)]) == 1
    out = capsys.readouterr().out
    assert "only before: grad (all rows), other (all rows)\n" in out, "old rows are not those of this run"


def test_a_run_is_compared_with_the_file_that_it_overwrites(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "b.json"
    slower = {"arm steps": {"value": 2e6, "unit": "steps/s"}, "gone": {"value": 1, "unit": "s"}}
    file.write_text(json.dumps({"arm": slower, "grad": ROWS}))
    assert main(["arm", "--json", str(file), "--against", str(file)]) == 0
    out = capsys.readouterr().out
    assert re.search(r"^arm +arm steps +2,000,000 +1,234,568 +0\.617 +higher$", out, re.MULTILINE)
    assert "only before: arm.gone\n" in out and "only now: arm.ratio, arm.arm\n" in out
    assert "not the same machine or versions: machine and versions not recorded before (all)" in out
    assert main(["arm", "--against", str(file)]) == 0
    out = capsys.readouterr().out
    assert "not the same" not in out and "only" not in out


def test_page_is_written_from_the_rows(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Also from a file, without measuring: bars kept and missed, and what the section's docstring says."""
    monkeypatch.setattr("experiments.benchmark.__main__.run_section", lambda name: pytest.fail("measured"))
    known = {
        "cpu": "Abacus 3",
        "cores": 2,
        "memory_gb": 8.0,
        "jax": "1.0",
        "commit": "0123456789abcdef",
        "load_before": 0.1,
    }
    rows = {"ratio_to_serial": {"value": 15.0, "unit": "1"}, "ticks_per_s": {"value": 30512.4, "unit": "1/s"}}
    slow = {"compile_s": {"value": 60.0, "unit": "s"}, "ratio_to_forward": {"value": 3.0, "unit": "1"}}
    file, written = tmp_path / "b.json", tmp_path / "b.md"
    file.write_text(
        json.dumps({"sweep": rows, "grad": slow, "mine": {"x": {"value": 1, "unit": "m"}}, "about": {"sweep": known}})
    )
    assert main(["page", "--json", str(file), "--page", str(written)]) == 0
    text = written.read_text()
    assert "| ratio_to_serial | 15 | 1 | >= 15 | yes |" in text
    assert "| ticks_per_s | 30,512 | 1/s | - | - |" in text
    assert "| compile_s | 60 | s | <= 35 | **no** |" in text and "| ratio_to_forward | 3 | 1 | <= 3 | yes |" in text
    assert "C MuJoCo, NumPy and SciPy, in float64" in text and "## mine" in text
    assert "on Abacus 3, 2 cores, 8.0 GB" in text and "jax 1.0" in text and "commit 0123456789ab;" in text
    assert text.count("Machine and versions were not recorded.") == 2 and "## about" not in text
    assert text.index("| ratio_to_forward") < text.index("Compile time:") < text.index("| compile_s")


def test_page_of_the_docs_is_that_of_its_rows() -> None:
    docs = Path(__file__).parents[2] / "docs"
    results = json.loads((docs / "benchmarks.json").read_text())
    assert (docs / "benchmarks.md").read_text() == page(results), "run: python -m experiments.benchmark page --json ..."
    missing = {(s, row) for s, bars in BARS.items() for row in bars if row not in results[s]}
    assert not missing
