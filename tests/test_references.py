"""Every place that the references page names exists, and no docstring cites a page that a reader does not have."""

import importlib
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "docs" / "references.md").read_text(encoding="utf-8")


def places() -> list[str]:
    """Dotted names of the last column; a bare name belongs to the module of the one before it."""
    found, module = [], ""
    for name in re.findall(
        r"`([A-Za-z_][\w.]*)`", "\n".join(line.split("|")[-2] for line in PAGE.splitlines() if line.count("|") > 2)
    ):
        if name.startswith("hrcjax."):
            found.append(name)
            module = name.rsplit(".", 1)[0]
        else:
            found.append(f"{module}.{name}")
    return found


@pytest.mark.parametrize("place", places())
def test_place_exists(place: str) -> None:
    try:
        importlib.import_module(place)
    except ModuleNotFoundError:
        module, name = place.rsplit(".", 1)
        assert hasattr(importlib.import_module(module), name), place


def test_page_has_places() -> None:
    assert len(places()) > 35 and "hrcjax.plan.potential.d_factor" in places()


def test_sources_are_papers() -> None:
    for file in [*(ROOT / "hrcjax").rglob("*.py"), *(ROOT / "experiments").rglob("*.py")]:
        assert not re.search(r"reference page \d", " ".join(file.read_text(encoding="utf-8").split())), file
