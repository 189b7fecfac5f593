"""Ctrl-C as a wish to end after this frame: what has been mapped is still written."""

import contextlib
import signal
import threading
from collections.abc import Iterator


class Wish:
    """Whether the user has asked to stop."""

    stop: bool = False


@contextlib.contextmanager
def stop_on_interrupt() -> Iterator[Wish]:
    """The first interrupt is remembered, the second one ends the program as usual."""
    wish = Wish()
    if threading.current_thread() is not threading.main_thread():  # signals come to the main thread alone
        yield wish
        return
    before = signal.getsignal(signal.SIGINT)

    def note(*_: object) -> None:
        wish.stop = True
        signal.signal(signal.SIGINT, before)

    signal.signal(signal.SIGINT, note)
    try:
        yield wish
    finally:
        signal.signal(signal.SIGINT, before)
