"""Progress where nobody measures single steps, and where the total is not known."""

import io

from hrcjax.lab.progress import Progress


class Clock:
    now = 0.0

    def __call__(self) -> float:
        return self.now


def test_the_first_frame_is_compiled_for_and_does_not_count_for_the_rate() -> None:
    clock, stream = Clock(), io.StringIO()
    with Progress(9, stream=stream, clock=clock, unit="frame") as progress:
        for i in range(5):
            clock.now += 20 if i == 0 else 2
            progress.advance(note=f"{i} blocks")
    assert stream.getvalue().splitlines() == [
        "1/9 frames (11 %), 0 blocks",
        "5/9 frames (55 %), 0.5 frames/s, 8.0 s left, 4 blocks",  # told at the end
    ]


def test_without_a_total_there_is_no_time_left() -> None:
    clock, stream = Clock(), io.StringIO()
    with Progress(None, stream=stream, clock=clock, unit="frame") as progress:
        for _ in range(3):
            clock.now += 6
            progress.advance()
    assert stream.getvalue().splitlines() == ["2 frames, 0.167 frames/s", "3 frames, 0.167 frames/s"]
