"""Checks of options that several programs have, before work begins: each error in one line, with what is accepted."""

from collections.abc import Collection
from pathlib import Path
from typing import Any

from hrcjax.lab.errors import UsageError
from hrcjax.lab.rows import read_results
from hrcjax.lab.writable import check_writable


def _word(option: str) -> str:
    return "--" + option.replace("_", "-")


def each_once(config: Any, *options: str) -> None:
    """Refuses options with no value, or with one given twice."""
    for option in options:
        values = getattr(config, option)
        if not values or len(set(values)) < len(values):
            raise UsageError(f"{_word(option)}: accepted are one or more values, each once")


def among(config: Any, option: str, accepted: Collection[str]) -> None:
    """Refuses a value of an option that is none of the accepted ones."""
    for value in getattr(config, option):
        if value not in accepted:
            raise UsageError(f"{_word(option)} {value}: accepted are {', '.join(accepted)}")


def at_least(config: Any, least: int, *options: str) -> None:
    """Refuses numbers below a least one."""
    for option in options:
        if not getattr(config, option) >= least:
            raise UsageError(f"{_word(option)} {getattr(config, option)}: accepted is {least} or more")


def check_outputs(config: Any, *options: str, new_folder: bool = False) -> None:
    """Refuses output files that could not be written, and a JSON file of another format.

    Args:
        options: names of the options for files; the one of rows is "json".
        new_folder: whether a folder that is missing will be made; else it is refused.
    """
    for option in options:
        file: Path | None = getattr(config, option)
        if file is None:
            continue
        if not file.parent.is_dir() and not new_folder:
            raise UsageError(f"no folder {file.parent} for {_word(option)}")
        if file.exists() and not file.is_file():
            kind = "a folder" if file.is_dir() else "no file"
            raise UsageError(f"{_word(option)} {file} is {kind}; give a file")
        check_writable(file.parent, _word(option))
        if option == "json":
            read_results(file)
