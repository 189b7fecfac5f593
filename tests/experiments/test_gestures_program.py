"""The program of gestures: blocks, hands in disorder, training on made hands, rows, and its errors in one line."""

import json
from dataclasses import replace
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from made_hands import made_hand

from experiments.gestures.__main__ import main
from experiments.gestures.config import EvaluateConfig, default_commands, default_weights
from experiments.gestures.data import EDGE, FOLDS, HELD, in_blocks
from experiments.gestures.measure import by_classifier, delays, false_starts, false_stops, looked, told
from experiments.gestures.page import page
from experiments.gestures.rows import BARS, definition, holds
from experiments.gestures.run import evaluate
from experiments.gestures.stream import KINDS, SHORT, flickering, with_commands, without_go
from experiments.gestures.train import Recipe, fit
from experiments.gestures.unlike import SCRAMBLED, similarity, turned
from hrcjax.hand import CLOSED, GO, OPEN, Classifier, CommandParams, calibration_error
from hrcjax.io.hand_files import classifier_text, read_classifier, read_commands

DATA = Path(__file__).parents[3] / "shared" / "data" / "gestures" / "keypoint.csv"
needs_data = pytest.mark.skipif(not DATA.is_file(), reason="no recorded hands in ../shared/data/gestures")


def made_hands(per_class: int = 120):
    """Drawn hands, slowly turning as in a recording."""
    ups = ((1, 1, 1, 1), (0, 0, 0, 0), (1, 0, 0, 0))
    x = [made_hand(up, 0.05 * k, 0.02, k) for up in ups for k in range(per_class)]
    return in_blocks(np.asarray(x), np.repeat(np.arange(3), per_class))


def test_blocks_are_parts_of_the_recording() -> None:
    hands = made_hands()
    assert sorted([*HELD, *(b for fold in FOLDS for b in fold)]) == list(range(10))
    for g in range(3):
        assert (np.diff(hands.block[hands.gesture == g]) >= 0).all()
        assert (np.bincount(hands.block[hands.gesture == g]) == 12).all()
    trained, held = hands.outside(), hands.of(*HELD)
    assert not np.isin(trained.block, HELD).any() and np.isin(held.block, HELD).all()
    rows = {x.tobytes(): k for k, x in enumerate(hands.x)}
    where = lambda some: np.array([rows[x.tobytes()] for x in some.x])  # noqa: E731
    apart = np.abs(where(trained)[:, None] - where(held)[None])
    assert apart.min() > EDGE - 1


def test_disorder_is_disorder_and_keeps_what_it_should() -> None:
    x, random = made_hands().x[:40], np.random.default_rng(0)
    for name, scramble in SCRAMBLED.items():
        found = scramble(x, random)
        assert found.shape == x.shape and np.abs(found - x).max() > 0.1, name
    moved = SCRAMBLED["shuffled"](x, random)
    np.testing.assert_allclose(np.sort(moved[..., 0], axis=1), np.sort(x[..., 0], axis=1))


@pytest.mark.parametrize("mirror", [1.0, -1.0])
def test_similarity_finds_turn_scale_and_mirror(mirror) -> None:
    a = np.random.default_rng(2).normal(size=(3, 6, 2))
    a -= a.mean(axis=1, keepdims=True)
    b = 1.7 * turned(a * [mirror, 1.0], np.array([0.3, 2.0, -1.0]))
    matrix, off = similarity(a, b)
    np.testing.assert_allclose(a @ matrix, b, atol=1e-9)
    np.testing.assert_allclose(off, 0, atol=1e-12)


@pytest.fixture(scope="module")
def trained():
    with jax.enable_x64(False), jax.numpy_dtype_promotion("standard"):
        return fit(made_hands().outside(), Recipe(hidden=(16,), steps=250, batch=48, others=60))


def test_made_hands_are_learnt_and_disorder_is_rejected(trained) -> None:
    seen = looked(by_classifier(trained), made_hands().of(*HELD), 0)
    assert seen.accuracy > 0.97 and seen.turned > 0.95
    assert min(seen.rejected.values()) > 0.6 and seen.confusion.sum() == 72


def test_weights_come_back_from_their_file(trained, tmp_path) -> None:
    file = tmp_path / "w.toml"
    file.write_text(classifier_text(trained, "# head"))
    back = read_classifier(file)
    for a, b in zip(jax.tree.leaves(trained), jax.tree.leaves(back), strict=True):
        np.testing.assert_allclose(a, b, rtol=1e-3, atol=1e-6)
    file.write_text(file.read_text().replace("sizes = [210, 16", "sizes = [210, 17"))
    with pytest.raises(ValueError, match="numbers instead of"):
        read_classifier(file)


def test_calibration_error_of_a_plain_loop() -> None:
    random = np.random.default_rng(3)
    p = random.dirichlet([0.5] * 4, 300).astype(np.float32)
    y = random.integers(0, 4, 300)
    total = 0.0
    for low in range(15):
        rows = [k for k in range(300) if low / 15 <= p[k].max() < (low + 1) / 15 or (low == 14 and p[k].max() >= 1)]
        if rows:
            right = np.mean([p[k].argmax() == y[k] for k in rows])
            total += len(rows) / 300 * abs(right - np.mean([p[k].max() for k in rows]))
    assert float(calibration_error(jnp.asarray(p), jnp.asarray(y))) == pytest.approx(total, abs=1e-5)


def test_the_shipped_table_is_the_default_and_a_short_go_is_refused(tmp_path) -> None:
    assert jax.tree.leaves(read_commands(default_commands())) == jax.tree.leaves(CommandParams())
    file = tmp_path / "c.toml"
    for text, words in (
        ("[go]\nhold = 0.2", "go.hold = 0.2: accepted is at least 0.5, as the arm moves after it"),
        ("[go]\nloss = 0", "go.loss = 0: accepted is at least 1"),
        ("[go]\nframes = 1", "go.frames = 1: accepted is at least 2"),
        ("[go]\nmisses = 3", "go.misses = 3: accepted is at most 0"),
        ("[go]\ncertainty = 0.1", "go.certainty = 0.1: accepted is at least 0.5"),
        ("longest_gap = 60", "longest_gap = 60: accepted is from over 0 to 0.5 s"),
        ("[stop]\nhold = 5", "stop.hold = 5: accepted is at most 0.2, as a stop must not wait"),
        ("[stop]\nframes = 30", "stop.frames = 30: accepted is at most 3"),
        ("[stop]\ncertainty = 1", "stop.certainty = 1: accepted is at most 0.9"),
        ("[stop]\nmisses = 0.5", "whole number of 0 or more"),
        ("[fly]\nhold = 1", "no such table"),
        ("[stop]\nwait = 1", "no such field"),
        ("[stop]\ncertainty = true", "number of 0 or more"),
        ("[stop]\nframes = 1.5", "whole number"),
    ):
        file.write_text(text)
        with pytest.raises(ValueError, match=words) as raised:
            read_commands(file)
        assert "\n" not in str(raised.value)


def test_a_stream_without_a_go_has_no_long_closed_hand_and_a_wrong_reader_starts_in_it() -> None:
    """The measure counts: a reader that takes every hand for a closed one starts the arm."""
    hands = made_hands()
    stream = without_go(hands, 30.0, 0)
    assert set(stream.kind) <= set(KINDS) and len(stream.x) >= 900 and SHORT < 0.5
    always = lambda x: np.eye(4)[np.full(len(x), CLOSED)]  # noqa: E731
    assert false_starts(stream, told(always, CommandParams(), stream))["go"] > 3
    never = lambda x: np.eye(4)[np.full(len(x), 3)]  # noqa: E731
    read = told(never, CommandParams(), stream)
    assert not read.command.any() and read.stopped.all()
    opened = lambda x: np.eye(4)[np.full(len(x), OPEN)]  # noqa: E731
    assert false_stops(stream, told(opened, CommandParams(), stream)) >= 1, "its one stop goes on"
    assert false_stops(stream, read) == 0
    wanted = with_commands(hands, 2, 0)
    assert (told(always, CommandParams(), wanted).command == GO).sum() >= 2
    rarely = flickering(wanted)
    assert rarely.seen[rarely.begins[1::2], 0].all() and not rarely.seen[rarely.begins[1::2] + 1].any()
    assert (delays(rarely, told(opened, CommandParams(), rarely))["open"] * 30 < 3.5).all()


def test_errors_are_one_line(tmp_path, capsys) -> None:
    (tmp_path / "empty").mkdir()
    for argv in (
        [],
        ["fly"],
        ["train", "--data", str(tmp_path / "none.csv")],
        ["run", "--video", str(tmp_path / "empty"), "--models", str(tmp_path)],
        ["evaluate", "--data", str(tmp_path / "none.csv"), "--streams", "-1"],
    ):
        assert main(argv) == 2
        assert capsys.readouterr().err.count("\n") == 1
    assert main(["--help"]) == 0


def test_every_bar_has_a_definition() -> None:
    assert all(definition(name) for name in BARS)
    assert holds("accuracy", 0.96) is False and holds("false_starts", 0) and holds("rows", 1) is None
    assert "(missed)" in page({"accuracy": {"value": 0.5, "unit": "1"}})


@pytest.mark.slow
@needs_data
def test_the_shipped_weights_hold_their_bars(tmp_path) -> None:
    config = replace(EvaluateConfig(DATA), quick=True, out=tmp_path / "run", json=tmp_path / "rows.json")
    assert isinstance(read_classifier(default_weights()), Classifier)
    with jax.enable_x64(False), jax.numpy_dtype_promotion("standard"):
        assert evaluate(config, 0.0) == 0
    rows = json.loads((tmp_path / "rows.json").read_text())["gestures"]
    assert all(holds(name, rows[name]["value"]) for name in BARS)
