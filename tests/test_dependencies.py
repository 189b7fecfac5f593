"""What is declared is imported or explained, and what is imported is declared; each has its line in the docs."""

import ast
import importlib.metadata
import re
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
PAGE = (ROOT / "docs" / "dependencies.md").read_text(encoding="utf-8")
OURS = {"hrcjax", "experiments", "configs"}
MODULES = {
    "imageio-ffmpeg": "imageio_ffmpeg", "mujoco-mjx": "mujoco.mjx", "orbax-checkpoint": "orbax", "pillow": "PIL", "ur-analytic-ik": "ur_analytic_ik",
    "import-linter": "importlinter", "pytest-xdist": "xdist",
}  # fmt: skip
"""Of packages whose module has another name."""
NO_IMPORT = "not imported|as text|a program|does not install it"


def name_of(requirement: str) -> str:
    return re.split(r"[<>=~!\[; ]", requirement)[0]


MAIN = [name_of(r) for r in PROJECT["dependencies"]]
EXTRAS = {k: [name_of(r) for r in v] for k, v in PROJECT["optional-dependencies"].items()}


def imported(*folders: str) -> set[str]:
    """Modules that files below some folders import, and those they name to `pytest.importorskip`; with their parents."""
    found = set()
    for folder in folders:
        for file in [ROOT / folder] if folder.endswith(".py") else (ROOT / folder).rglob("*.py"):
            for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
                if isinstance(node, ast.Import):
                    found |= {alias.name for alias in node.names}
                elif isinstance(node, ast.ImportFrom) and node.level == 0 and node.module:
                    found |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
                elif isinstance(node, ast.Call) and ast.unparse(node.func).endswith("importorskip"):
                    found |= {ast.literal_eval(node.args[0])}
    return {".".join(name.split(".")[: k + 1]) for name in found for k in range(name.count(".") + 1)}


CODE = imported("hrcjax", "experiments", "configs")
TESTS = imported("tests", "notebooks")


def reason(package: str) -> str:
    row = re.search(rf"^\| {re.escape(package)} \|(.*)\|$", PAGE, re.MULTILINE)
    assert row, f"{package} has no line in docs/dependencies.md"
    return row.group(1)


@pytest.mark.parametrize("package", sorted({*MAIN, *(name for names in EXTRAS.values() for name in names)}))
def test_declared_is_imported_or_explained(package: str) -> None:
    used = CODE if package in MAIN else CODE | TESTS
    module = MODULES.get(package, package)
    why = reason(package)
    assert len(why) > 10
    assert (module in used) != bool(re.search(NO_IMPORT, why)), f"{package}: imported, or said why not; not both"


def test_imported_is_declared() -> None:
    declared = {MODULES.get(name, name).split(".")[0] for name in MAIN}
    optional = {MODULES.get(name, name).split(".")[0] for names in EXTRAS.values() for name in names}
    known = set(sys.stdlib_module_names) | OURS | declared | {"mpl_toolkits"}  # comes with matplotlib
    top = {name.split(".")[0] for name in CODE}
    assert top - known - optional == set()
    assert (top & optional) - known <= {
        "rosbags",
        "cmaes",
        "optax",
        "orbax",
        "ompl",
        "pyoctomap",
        "toppra",
        "imageio_ffmpeg",
    }, "an extra that the programs import themselves"
    local = {file.stem for file in (ROOT / "tests").rglob("*.py")}
    known |= {"IPython"}  # comes with ipykernel
    assert {name.split(".")[0] for name in TESTS} - known - optional - local == set()


def test_every_line_of_the_page_is_declared() -> None:
    named = set(re.findall(r"^\| ([a-z0-9-]+) \|", PAGE, re.MULTILINE)) - {"package"}
    assert named == {*MAIN, *(name for names in EXTRAS.values() for name in names)}


def test_installed_versions_are_allowed() -> None:
    """The pin of jax is the version that the tests run with."""
    pin = next(r for r in PROJECT["dependencies"] if name_of(r) == "jax")
    assert pin == f"jax=={importlib.metadata.version('jax')}"
