"""Messages about frames that are not used: the first few of each reason, further ones are counted."""

from collections import Counter
from collections.abc import Callable

EACH, MOST = 3, 20
"""Largest number of messages for one reason, and in total."""


class Notices:
    """Reports why frames are not used."""

    def __init__(self, say: Callable[[str], None]) -> None:
        self.say = say
        self.reasons: Counter[str] = Counter()
        self.said = 0

    def add(self, frame: str, reason: str) -> None:
        """Records one frame.

        Args:
            frame: its name in the message.
            reason: the same text for the same reason.
        """
        self.reasons[reason] += 1
        times = self.reasons[reason]
        if self.said >= MOST or times > EACH:
            return
        self.said += 1
        more = " (further ones are counted)" if times == EACH or self.said == MOST else ""
        self.say(f"{frame}: {reason}{more}")

    def add_line(self, text: str) -> None:
        """Records a line "frame: reason"."""
        frame, _, reason = text.partition(": ")
        self.add(frame, reason or "not usable")

    def text(self) -> str:
        """Counts of the reasons, most frequent first."""
        return "; ".join(f"{times} x {reason}" for reason, times in self.reasons.most_common(6))
