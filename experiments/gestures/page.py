"""The page of the rows, as Markdown."""

from collections.abc import Mapping, Sequence
from typing import Any

from .rows import BARS, definition, holds

HEAD = """# Commands by hand

Written by `python -m experiments.gestures evaluate --data FILE --json FILE --page FILE`; do not edit. `--help` explains every option.

An open hand stops the arm, a closed one lets it go on, a pointing one names a place, two open ones name home. Hands are the 21 landmarks
of MediaPipe. What looks like none of these gestures is no command.

* **Features**: the 210 distances between landmarks over their root mean square. They do not change with the hand's place, size, turn in the
  image and side, exactly; nothing of it has to be learnt, and left and right need not be told apart.
* **Classifier**: one hidden layer of 64 units, trained by AdamW on hands shortened along a direction by chance and with noise. The fourth
  class, none, learns from shuffled landmarks, random points, heavy noise, and hands with other fingers extended: fingers of an open hand
  on the palm of a closed one that fits it.
* **Blocks**: the recording has 4,450 frames one after the other. Each class is divided into ten blocks in time; blocks 2 and 7 are held out, and
  five rows on both sides of every border between blocks are not trained on. Hyperparameters were chosen on four inner folds of the other
  eight blocks (`train --choose`), by the mean of accuracy, accuracy turned, disorder rejected and other fingers rejected: 0.979, 0.975, 0.973, 0.971
  as shipped; with half the noise 0.971, 0.962, 0.977, 0.980; with 1.5 times the noise 0.980, 0.978, 0.964, 0.967. Half the noise
  gave 0.968 and 0.940 on the held-out blocks, which were looked at once before the noise was chosen.
* **Commands**: a frame votes for a command where the gesture's probability is high enough. Stop needs two votes, with at most two frames
  between them without a vote. Go, point and home need half a second or more, in which a frame without vote takes away twice its time; a stop takes back what was shown before it. A
  command is given in a frame that votes for it: the loss of a hand gives none, and ends no stop. Only a go lets the arm move; point and
  home choose where to. `configs/gestures/commands.toml` is the table.
* **Streams**: made of the held-out rows at 30 frames a second. The first has no go: no hand, hands in disorder, other gestures, open and
  pointing hands as recorded, transitions between them, hands half hidden, and hands that close for at most 0.35 s. The second
  shows open, closed and pointing hands 100 times each, 1.5 s long; `flicker` are the same hands, every second image of which sees none.
"""
READ = """
## How to read it

* The rule takes a finger as extended if its tip is 1.15 times as far from the wrist as its middle joint. It needs no training, and
  rejects little. The plain network gets coordinates about the wrist over the greatest one; it has no class for what is none.
* What remains wrong are mostly pointing hands taken for closed ones and the reverse: the index is half bent, or points at the camera. A single
  frame is no command, so that errors of single frames cost time only; `gos_seen` and `points_seen` tell how often 1.5 s were not enough.
* All rows are of one recording, of one person. Other people, gloves, and cameras from above are not in it.
* `run` was tried with MediaPipe 1.2.2 on drawn and rendered hands, in none of which its model found a hand: nothing is measured from camera
  image to command.
* The disorder `mixed` and `torn` is of kinds that training did not see. Other real gestures, such as a thumb or a V, are
  represented by hands put together (`rejected_other`), not by recordings.
"""


def page(rows: Mapping[str, Mapping[str, Any]], figures: Sequence[str] = ()) -> str:
    """A Markdown page of the rows.

    Args:
        figures: their places from the page.
    """
    lines = ["| row | value | unit | bar | what it measures |", "|---|---|---|---|---|"]
    for name, entry in rows.items():
        bar = f"{BARS[name][0]} {BARS[name][1]:g}" if name in BARS else ""
        missed = " (missed)" if holds(name, entry["value"]) is False else ""
        lines.append(f"| {name} | {entry['value']:.3g} | {entry['unit']} | {bar}{missed} | {definition(name)} |")
    text = HEAD + "\n" + "\n".join(lines) + "\n" + READ
    if figures:
        text += "\n" + "\n".join(f"![{name}]({name})" for name in figures) + "\n"
    return text
