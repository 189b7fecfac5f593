"""Ctrl-C and SIGTERM as a wish to end after this frame: what has been mapped is still written."""

import contextlib
import signal
import threading
from collections.abc import Iterator

SIGNALS = (signal.SIGINT, signal.SIGTERM)
"""From the keyboard; from a scheduler or a container that stops."""


class Wish:
    """Whether the user, or the machine, has asked to stop."""

    stop: bool = False
    status: int = 0
    """The exit status that tells it: 128 and the signal's number."""


@contextlib.contextmanager
def stop_on_interrupt() -> Iterator[Wish]:
    """The first signal is remembered, the second one ends the program as usual."""
    wish = Wish()
    if threading.current_thread() is not threading.main_thread():  # signals come to the main thread alone
        yield wish
        return
    before = {number: signal.getsignal(number) for number in SIGNALS}

    def restore() -> None:
        for number, handler in before.items():
            signal.signal(number, handler)

    def note(number: int, _: object) -> None:
        wish.stop, wish.status = True, 128 + number
        restore()

    for number in SIGNALS:
        signal.signal(number, note)
    try:
        yield wish
    finally:
        restore()
