"""All programs by name: listed, found, and installed under one name of the project's own."""

import fnmatch
import importlib
import subprocess
import sys
import types
from pathlib import Path

import pytest

from experiments.__main__ import main, programs

ROOT = Path(__file__).parents[2]
NAMES = [
    "avoidance",
    "benchmark",
    "figures",
    "grasp",
    "hri",
    "interact",
    "map",
    "pointing",
    "reproduce",
    "safety",
    "sensing",
    "sweep",
    "task_space",
    "tune",
]


def test_every_folder_with_a_main_is_listed(capsys: pytest.CaptureFixture[str]) -> None:
    assert [name for name in programs() if name in NAMES] == NAMES
    assert main([]) == 0
    bare = capsys.readouterr().out
    assert main(["--help"]) == 0
    assert capsys.readouterr().out == bare
    lines = {line.split()[0]: line.split()[1:] for line in bare.splitlines() if line.startswith("  ")}
    assert list(lines) == list(programs())
    assert all(len(words) > 3 for words in lines.values())  # what each does


def test_an_unknown_program_gets_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["sweeep"]) == 2
    printed = capsys.readouterr()
    assert printed.out == "" and printed.err.count("\n") == 1
    assert printed.err.startswith("error: no program 'sweeep'; accepted: ")
    assert all(name in printed.err for name in NAMES)


def test_a_program_gets_the_other_words_and_its_status_is_returned(monkeypatch: pytest.MonkeyPatch) -> None:
    got = []
    module = types.ModuleType("experiments.map.__main__")
    module.main = lambda words: got.append(words) or 3  # pyright: ignore[reportAttributeAccessIssue]
    monkeypatch.setitem(sys.modules, "experiments.map.__main__", module)
    assert main(["map", "--input", "x"]) == 3
    assert got == [["--input", "x"]]


@pytest.mark.slow
def test_from_a_shell() -> None:
    run = [sys.executable, "-m", "experiments"]
    listed = subprocess.run(run, cwd=ROOT, capture_output=True, text=True)
    assert listed.returncode == 0 and "  sweep " in listed.stdout
    unknown = subprocess.run([*run, "none"], cwd=ROOT, capture_output=True, text=True)
    assert unknown.returncode == 2 and unknown.stderr.startswith("error: no program 'none'")


def test_nothing_but_the_own_name_is_installed(monkeypatch: pytest.MonkeyPatch) -> None:
    """What setup.py tells setuptools: an installed `experiments` or `configs` would shadow somebody else's."""
    told = {}

    def find_packages(include: list[str]) -> list[str]:
        found = [path.parent.relative_to(ROOT) for path in ROOT.glob("[!.]*/**/__init__.py")]
        names = [".".join(path.parts) for path in found]
        return [name for name in names if any(fnmatch.fnmatch(name, pattern) for pattern in include)]

    stub = types.ModuleType("setuptools")
    stub.setup, stub.find_packages = lambda **settings: told.update(settings), find_packages  # pyright: ignore[reportAttributeAccessIssue]
    monkeypatch.setitem(sys.modules, "setuptools", stub)
    monkeypatch.chdir(ROOT)
    exec(compile((ROOT / "setup.py").read_text(), "setup.py", "exec"), {"__name__": "__main__"})
    packages = told["packages"]
    assert {name.partition(".")[0] for name in packages} == {"hrcjax"}
    assert len(packages) == len(set(packages))
    assert set(told["package_dir"]) == {"hrcjax.programs", "hrcjax.configs"}

    def folder(package: str) -> Path:
        """Where setuptools looks for a package: the longest name in package_dir decides."""
        for start in sorted(told["package_dir"], key=len, reverse=True):
            if package == start or package.startswith(start + "."):
                return ROOT / told["package_dir"][start] / package[len(start) + 1 :].replace(".", "/")
        return ROOT / package.replace(".", "/")

    assert all(folder(name).is_dir() for name in packages)
    code = {path.parent for top in ("hrcjax", "experiments") for path in (ROOT / top).rglob("*.py")}
    assert code <= {folder(name) for name in packages}  # nothing is forgotten
    data = {name: patterns for name, patterns in told["package_data"].items() if name.startswith("hrcjax.configs")}
    shipped = {file for name, patterns in data.items() for pattern in patterns for file in folder(name).glob(pattern)}
    assert shipped == set((ROOT / "configs").rglob("*.toml"))


def test_programs_import_nothing_by_the_name_that_only_a_checkout_has() -> None:
    """Installed they are hrcjax.programs.*: `from experiments...` would fail there."""
    for path in (ROOT / "experiments").rglob("*.py"):
        for line in path.read_text().splitlines():
            assert not line.strip().startswith(("from experiments", "import experiments")), path
    for name in NAMES:
        assert callable(importlib.import_module(f"experiments.{name}.__main__").main)
