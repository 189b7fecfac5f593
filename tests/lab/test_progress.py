"""Time left, lines now and then, and a bar on a terminal."""

import io

import pytest

from hrcjax.lab.progress import Progress, duration


@pytest.mark.parametrize(
    ("seconds", "text"),
    [
        (0.04, "0.0 s"), (3.21, "3.2 s"), (12.4, "12 s"), (59.4, "59 s"), (59.6, "1 min 0 s"), (200, "3 min 20 s"),
        (7500, "2 h 5 min"),
    ],
)  # fmt: skip
def test_durations_in_words(seconds: float, text: str) -> None:
    assert duration(seconds) == text


class Clock:
    now = 0.0

    def __call__(self) -> float:
        return self.now


def test_lines_come_every_ten_seconds_and_at_the_end() -> None:
    clock, stream = Clock(), io.StringIO()
    with Progress(100, 20, stream, clock=clock) as progress:
        assert progress.left() == float("inf")
        for _ in range(8):
            clock.now += 4
            progress.advance(10, 4)
    lines = stream.getvalue().splitlines()
    assert lines == [
        "50/100 settings (50 %), 2.5 settings/s, 20 s left",
        "80/100 settings (80 %), 2.5 settings/s, 8.0 s left",
        "100/100 settings (100 %), 2.5 settings/s, 0.0 s left",
    ]


def test_resumed_settings_do_not_count_for_the_rate() -> None:
    progress = Progress(100, 50, io.StringIO())
    progress.advance(10, 5)
    assert progress.left() == 20


def test_a_terminal_gets_a_bar_with_the_time_left() -> None:
    class Terminal(io.StringIO):
        def isatty(self) -> bool:
            return True

    stream = Terminal()
    with Progress(100, 20, stream) as progress:
        progress.say("compiled")
        progress.advance(60, 30)
        assert progress.bar is not None
        progress.bar.refresh()
    shown = stream.getvalue()
    assert "80/100" in shown and "10 s left" in shown and "compiled" in shown and "\r" in shown
