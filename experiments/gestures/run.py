"""What each command does: from options to weights, rows, page and figures."""

import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from hrcjax.hand import Classifier, CommandParams
from hrcjax.io.hand_files import classifier_text, read_classifier, read_commands
from hrcjax.lab.atomic import replace_file, write_bytes
from hrcjax.lab.checks import at_least, check_outputs
from hrcjax.lab.errors import UsageError
from hrcjax.lab.progress import duration
from hrcjax.lab.rows import table, write_rows
from hrcjax.lab.writable import check_writable

from .config import Config, EvaluateConfig, RunConfig, TrainConfig, default_commands, default_weights
from .data import HELD, read_hands
from .measure import Looked, Told, by_classifier, by_rule, delays, false_starts, false_stops, looked, told
from .rows import Rows, delay_rows, flicker_rows, holds, looked_rows, row
from .stream import RATE, Stream, flickering, with_commands, without_go
from .train import Recipe, fit, plain_network

HEAD = """# Weights of the classifier of gestures: 210 distances, {hidden} hidden units, 4 gestures. Written by
#
# Command: python -m experiments.gestures train --data {data} --weights {weights}
# Minutes on 2 cores: less than 1.
# Figures: none."""


def run(config: Config) -> int:
    """Trains, evaluates or runs; returns the exit status: 0."""
    begin = time.monotonic()
    if isinstance(config, TrainConfig):
        return train(config, begin)
    if isinstance(config, EvaluateConfig):
        return evaluate(config, begin)
    return watch(config)


def watch(config: RunConfig) -> int:
    """Reads commands from a video."""
    from .video import watched  # here: it needs an extra

    return watched(config, *known_files(config))


def known_files(config: EvaluateConfig | RunConfig) -> tuple[Classifier, CommandParams]:
    """The classifier and the table of commands.

    Raises:
        UsageError: a file is missing or has another format.
    """
    try:
        return read_classifier(config.weights or default_weights()), read_commands(
            config.commands or default_commands()
        )
    except OSError as error:
        raise UsageError(f"{error.filename}: cannot be read; accepted are files as in configs/gestures") from error
    except ValueError as error:
        raise UsageError(str(error)) from error


def train(config: TrainConfig, begin: float) -> int:
    """Trains, or compares hyperparameters."""
    at_least(config, 1, "steps")
    check_outputs(config, "weights")
    hands, recipe = read_hands(config.data), replace(Recipe(), steps=config.steps)
    if config.choose:
        from .choose import compared

        for line in compared(hands, recipe, config.seed):
            print(line, flush=True)
        return 0
    model = fit(hands.outside(), recipe, config.seed)
    head = HEAD.format(
        hidden=" + ".join(map(str, recipe.hidden)),
        data=config.data.name,
        weights=f"configs/gestures/{config.weights.name}",
    )
    write_bytes(config.weights, classifier_text(model, head).encode())
    right = (by_classifier(model)(hands.outside().x).argmax(axis=1) == hands.outside().gesture).mean()
    print(
        f"Trained on {len(hands.outside().x)} rows, {right:.4f} of them right, in {duration(time.monotonic() - begin)}."
    )
    print(f"-> {config.weights}; evaluate says how good it is on the blocks {HELD[0]} and {HELD[1]}")
    return 0


def evaluate(config: EvaluateConfig, begin: float) -> int:
    """Measures, and writes rows, figures and page."""
    if config.quick:
        config = replace(config, minutes=1.0, streams=1)
    at_least(config, 0, "streams")
    if not 0.1 <= config.minutes <= 1000:
        raise UsageError(f"--minutes {config.minutes}: accepted is 0.1 to 1000")
    check_outputs(config, "json", "page")
    check_writable(config.out, "--out")
    hands = read_hands(config.data)
    held = hands.of(*HELD)
    model, commands = known_files(config)
    config.out.mkdir(parents=True, exist_ok=True)

    ways = {"": by_classifier(model), "_rule": by_rule()}
    if not config.quick:
        ways["_plain"] = plain_network(hands.outside(), seed=config.seed)
    seen = {end: looked(way, held, config.seed) for end, way in ways.items()}
    rows: Rows = {"rows": row(len(held.x))}
    for end, one in seen.items():
        rows |= looked_rows(one, end)

    hard = without_go(held, 60 * config.minutes, config.seed)
    read = told(ways[""], commands, hard)
    counts = false_starts(hard, read)
    rows |= {
        "false_starts": row(counts["go"]),
        "false_goals": row(counts["home"] + counts["point"]),
        "stream_minutes": row(len(hard.x) / RATE / 60, "min"),
    }
    more = [without_go(held, 60 * config.minutes, config.seed + 1 + k) for k in range(config.streams)]
    shown = [(one, told(ways[""], commands, one)) for one in more]
    rows["false_starts_more"] = row(sum(false_starts(*one)["go"] for one in shown))
    rows["false_stops"] = row(sum(false_stops(*one) for one in [(hard, read), *shown]))
    rows["minutes_more"] = row(sum(len(one.x) for one in more) / RATE / 60, "min")
    rows["false_starts_rule"] = row(false_starts(hard, told(ways["_rule"], commands, hard))["go"])
    wanted = with_commands(held, 100, config.seed)
    noticed = told(ways[""], commands, wanted)
    rows |= delay_rows(delays(wanted, noticed), RATE)
    rarely = flickering(wanted)
    rows |= flicker_rows(delays(rarely, told(ways[""], commands, rarely)), RATE)
    write_rows(config.out, config.json, {"gestures": rows})
    names = draw(config.out, seen, (hard, read), (wanted, noticed))
    if config.page:
        from .page import page

        write_bytes(config.page, page(rows, copied(config.out, config.page, names)).encode())
    print(table("gestures", rows))
    failed = [name for name, entry in rows.items() if holds(name, entry["value"]) is False]
    print(f"\n{len(failed)} bars do not hold" + (f": {', '.join(failed)}" if failed else ""))
    print(f"Took {duration(time.monotonic() - begin)}. Rows and figures: {config.out}", file=sys.stdout)
    return 0


def draw(folder: Path, seen: dict[str, Looked], hard: tuple[Stream, Told], wanted: tuple[Stream, Told]) -> list[str]:
    """Figures into the folder; their names."""
    from .figures import confusion_figure, reliability_figure, stream_figure

    words = {"": "distances", "_rule": "extended fingers", "_plain": "plain network"}
    shown = {words[end]: one for end, one in seen.items()}
    smooth = {name: one for name, one in shown.items() if name != "extended fingers"}
    stands = np.flatnonzero(hard[1].command)
    begin = max(int(stands[0]) - 60, 0) if len(stands) else 0
    figures = {
        "confusion.png": confusion_figure(shown),
        "reliability.png": reliability_figure(smooth),
        "stream.png": stream_figure(
            *hard, begin, min(900, len(hard[0].x) - begin), "Half a minute without a go: the arm stands"
        ),
        "commands.png": stream_figure(*wanted, 0, 450, "Open, closed and pointing hands: stop, go and point"),
    }
    for name, figure in figures.items():
        replace_file(folder / name, lambda path, figure=figure: figure.savefig(path, dpi=110, format="png"))
    return list(figures)


def copied(folder: Path, page: Path, names: list[str]) -> list[str]:
    """Figures copied beside the page; their places from there."""
    place = page.parent / "figures"
    place.mkdir(exist_ok=True)
    for name in names:
        write_bytes(place / f"gestures-{name}", (folder / name).read_bytes())
    return [f"figures/gestures-{name}" for name in names]
