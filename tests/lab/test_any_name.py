"""Names of files that are no text, or mean something to figures, print and are drawn."""

import io
import sys
import warnings

import matplotlib.pyplot as plt
import pytest

from hrcjax.lab.any_name import print_any_name, printable, title

NAMES = [r"a $x_{$", b"ha\xe4nd".decode(errors="surrogateescape"), "中文", "plain"]


def test_bytes_that_are_no_text_are_shown_as_such() -> None:
    assert [printable(name) for name in NAMES] == [r"a $x_{$", r"ha\xe4nd", "中文", "plain"]


@pytest.mark.parametrize("name", NAMES)
def test_figures_take_every_title(name: str) -> None:
    figure, axes = plt.subplots()
    axes.set_title(f"Distance: {title(name)}")
    with warnings.catch_warnings(action="ignore"):  # the font lacks Chinese
        figure.savefig(io.BytesIO(), format="png")
    plt.close(figure)


@pytest.mark.parametrize("name", NAMES[1:3])
def test_streams_of_any_encoding_print_every_name(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    stream = io.TextIOWrapper(io.BytesIO(), encoding="ascii")
    with pytest.raises(UnicodeEncodeError):
        print(name, file=stream, flush=True)
    stream = io.TextIOWrapper(io.BytesIO(), encoding="ascii")
    monkeypatch.setattr(sys, "stdout", stream)
    with warnings.catch_warnings():
        print_any_name()
    print(name, flush=True)
    assert stream.buffer.getvalue().startswith((b"ha\\udce4nd", b"\\u4e2d\\u6587"))  # pyright: ignore[reportAttributeAccessIssue]
