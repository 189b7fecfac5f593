"""Named settings of the programs: TOML files whose keys are a program's options."""

import tomllib
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeVar

from hrcjax.lab.errors import UsageError, one_line
from hrcjax.lab.options import parse_options

T = TypeVar("T")

_PACKAGE = Path(__file__).resolve().parents[1]


def configs_folder() -> Path:
    """The folder of named settings: inside the installed package, or beside it in a checkout."""
    installed = _PACKAGE / "configs"
    return installed if installed.is_dir() else _PACKAGE.parent / "configs"


def config_names(program: str) -> list[str]:
    """The named settings of a program, sorted."""
    return sorted(path.stem for path in (configs_folder() / program).glob("*.toml"))


def _find(program: str, name: str) -> Path:
    """The file of named settings, or the user's own file.

    Raises:
        UsageError: it does not exist.
    """
    if name.endswith(".toml"):
        if not Path(name).is_file():
            raise UsageError(f"--config {name}: no such file")
        return Path(name)
    if name not in config_names(program):
        raise UsageError(
            f"no config {name!r}; accepted: {', '.join(config_names(program))}, or a file that ends in .toml"
        )
    return configs_folder() / program / f"{name}.toml"


def _words(key: str, value: Any) -> list[str]:
    """One key of a file as command-line arguments."""
    option = "--" + key.replace("_", "-")
    if key in ("config", "help"):
        raise UsageError(f"{key}: not accepted in a file")
    if isinstance(value, bool):
        return [option if value else f"--no-{option[2:]}"]
    values = value if isinstance(value, list) else [value]
    if not all(isinstance(one, str | int | float) and not isinstance(one, bool) for one in values):
        raise UsageError(f"{key}: accepted is a string, a number, true, false, or a list of strings or numbers")
    if any(isinstance(one, str) and one.startswith("--") for one in values):
        raise UsageError(f"{key}: a string that starts with -- is not accepted")
    return [option, *map(str, values)]


def read_config(kind: Callable[..., T], program: str, name: str) -> T:
    """The options set by a file of named settings, with the defaults of `kind` for the others.

    Args:
        kind: the dataclass of the program's options.
        program: its name, which is its folder in `configs`.
        name: of the settings, or a path that ends in .toml.

    Raises:
        UsageError: no such settings, invalid TOML, an unknown key, or a value of the wrong type.
    """
    path = _find(program, name)
    try:
        entries = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise UsageError(f"--config {path}: {one_line(error)}") from error
    try:
        words = [word for key, value in entries.items() for word in _words(key, value)]
        return parse_options(kind, words, program)
    except UsageError as error:
        raise UsageError(f"--config {path}: {error}") from error


def parse_config(kind: type[T], argv: Sequence[str], program: str, description: str) -> T:
    """The options of a program from the command line, on top of the named settings of its --config.

    Args:
        kind: the dataclass of the options, with a field `config`.
        program: its name, which is its folder in `configs`.
        description: for --help.

    Raises:
        UsageError: an unknown option or config, a value of the wrong type.
        SystemExit: with status 0 after --help.
    """
    name = config_name(argv, kind.config)  # pyright: ignore[reportAttributeAccessIssue]
    start = replace(read_config(kind, program, name), config=name)  # pyright: ignore[reportArgumentType, reportCallIssue]
    return parse_options(kind, argv, f"python -m experiments.{program}", description=description, default=start)


def config_name(argv: Sequence[str], default: str) -> str:
    """The value of --config on a command line."""
    name = default
    for i, word in enumerate(argv):
        if word == "--config" and i + 1 < len(argv):
            name = argv[i + 1]
        elif word.startswith("--config="):
            name = word.partition("=")[2]
    return name
