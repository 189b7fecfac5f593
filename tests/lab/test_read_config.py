"""Files of named settings: their keys become options, and what is wrong with one is told in a line that names it."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import pytest

from hrcjax.lab.configs import config_name, read_config
from hrcjax.lab.errors import UsageError


@dataclass(frozen=True)
class Options:
    """Some options."""

    seed: tuple[int, ...] = (0,)
    """Seeds."""
    memory: float = 1.5
    """Memory [MB]."""
    sample_seed: int = 3
    """One more."""
    figures: bool = True
    """Draw."""
    backend: Literal["folded", "mjx"] = "folded"
    """Dynamics."""
    out: Path | None = None
    """Folder."""


def test_every_kind_of_value_arrives(tmp_path: Path) -> None:
    file = tmp_path / "mine.toml"
    text = 'seed = [1, 2]\nmemory = 2e3\nsample_seed = -4\nfigures = false\nbackend = "mjx"\nout = "my folder/r"'
    file.write_text(text)
    found = read_config(Options, "sweep", str(file))
    assert found == Options((1, 2), 2000.0, -4, False, "mjx", Path("my folder/r"))
    file.write_text("figures = true")
    assert read_config(Options, "sweep", str(file)) == Options()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("seed = [1", "Unclosed array"),
        ("seed = 1\nseed = 2", "Cannot overwrite a value"),
        (b"out = '\xff'", "codec can't decode"),
        ("sed = 1", "Unrecognized options: --sed"),
        ("memory = 'much'", "'much'"),
        ("seed = [1, 'two']", "two"),
        ("seed = 1.5", "1.5"),
        ("backend = 'bullet'", "invalid choice 'bullet'"),
        ("seed = [true]", "seed: accepted is a string, a number, true, false, or a list of strings or numbers"),
        ("[out]\nfolder = 'x'", "out: accepted is a string"),
        ("seed = 2020-01-01", "seed: accepted is a string"),
        ("figures = 'yes'", "yes"),
    ],
)
def test_a_wrong_file_gets_one_line_that_names_it(text: str | bytes, message: str, tmp_path: Path) -> None:
    file = tmp_path / "mine.toml"
    file.write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(UsageError) as caught:
        read_config(Options, "sweep", str(file))
    assert str(caught.value).startswith(f"--config {file}: ") and message in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("fast", "no config 'fast'; accepted: paper, people, quick, or a file that ends in .toml"),
        ("absent.toml", "--config absent.toml: no such file"),
        ("../sweep/paper", "no config '../sweep/paper'"),
    ],
)
def test_settings_that_are_not_there(name: str, message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(UsageError) as caught:
        read_config(Options, "sweep", name)
    assert message in str(caught.value)


@pytest.mark.parametrize(
    ("words", "name"),
    [
        ([], "paper"),
        (["--config", "quick"], "quick"),
        (["--seed", "1", "--config=a.toml"], "a.toml"),
        (["--config"], "paper"),
    ],
)
def test_name_on_a_command_line(words: list[str], name: str) -> None:
    assert config_name(words, "paper") == name
