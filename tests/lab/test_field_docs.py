"""Units and meanings come from the docstrings of fields."""

import equinox as eqx
import pytest

from hrcjax.lab.field_docs import class_docs, leaf_docs, split_unit


class Inner(eqx.Module):
    """Not a field."""

    gain: float = 1.0
    """Gain of the servo; our
    choice [1/s]. More words [m]."""
    bare: float = 2.0
    plain: float = 3.0
    """No unit here."""


class Outer(eqx.Module):
    inner: Inner = eqx.field(default_factory=Inner)
    """A group."""
    radius: float = 0.1
    """Radius [m]."""


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("Radius [m].", ("Radius", "m")),
        ("Repulsion K_rep [m^(4-n)/step]. The force is long.", ("Repulsion K_rep", "m^(4-n)/step")),
        ("No unit. Second.", ("No unit", "1")),
        ("One. Two [s].", ("One", "s")),
    ],
)
def test_split(text: str, parts: tuple[str, str]) -> None:
    assert split_unit(text) == parts


def test_docs_of_a_class_and_of_a_tree() -> None:
    assert class_docs(Inner)["gain"] == "Gain of the servo; our choice [1/s]. More words [m]."
    assert leaf_docs(Outer()) == {
        "inner.gain": ("Gain of the servo; our choice", "1/s"),
        "inner.plain": ("No unit here", "1"),
        "radius": ("Radius", "m"),
    }


def test_classes_without_source_have_no_docs() -> None:
    assert class_docs(int) == {}
