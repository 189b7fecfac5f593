"""Ctrl-C and SIGTERM as a request to stop after the current frame, so that results are written."""

import contextlib
import signal
import threading
from collections.abc import Iterator

SIGNALS = (signal.SIGINT, signal.SIGTERM)
"""Ctrl-C; a scheduler or container that stops the process."""


class Wish:
    """Whether a stop was requested."""

    stop: bool = False
    status: int = 0
    """Exit status: 128 plus the signal's number."""


@contextlib.contextmanager
def stop_on_interrupt() -> Iterator[Wish]:
    """The first signal sets the request, the second one ends the program as usual."""
    wish = Wish()
    if threading.current_thread() is not threading.main_thread():  # only the main thread receives signals
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
