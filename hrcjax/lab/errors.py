"""What a program tells its user in one line instead of a traceback."""

import contextlib
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator

import jax

from hrcjax.lab.any_name import print_any_name


class UsageError(ValueError):
    """A wrong name, value, file or mix of options. The message is one line: what was wrong, what is accepted."""


class StorageError(OSError):
    """Results could not be written: a full disk, a missing right. What was finished before is still there."""


def one_line(error: BaseException) -> str:
    """The message of an error without line breaks; the name of its type if it has none."""
    return " ".join(str(error).split()) or type(error).__name__


class Terminated(KeyboardInterrupt):
    """The system asked the program to end (SIGTERM): as Ctrl-C, so that what was finished is kept."""


@contextlib.contextmanager
def _terminated_as_interrupt() -> Iterator[list[int]]:
    """SIGTERM becomes `Terminated`, unless somebody had it handled or ignored already; lists the signals that came."""
    came: list[int] = []
    main = threading.current_thread() is threading.main_thread()  # signals come to the main thread alone
    if not main or signal.getsignal(signal.SIGTERM) is not signal.SIG_DFL:
        yield came
        return

    def stop(number: int, _: object) -> None:
        came.append(number)
        raise Terminated

    signal.signal(signal.SIGTERM, stop)
    try:
        yield came
    finally:
        signal.signal(signal.SIGTERM, signal.SIG_DFL)


def _lacks_platform() -> str:
    """What is wrong with the kind of device that the environment asks JAX for, in words; "": nothing."""
    asked = os.environ.get("JAX_PLATFORMS", "")
    if asked:
        try:
            jax.devices()
        except Exception as error:  # an assertion without words, or a runtime error
            said = str(error).split(" (set JAX_PLATFORMS")[0]  # JAX's own advice
            reason = f" ({' '.join(said.split()).rstrip('.')})" if said else ""
            return f"JAX_PLATFORMS={asked} in the environment: no such device here{reason}; unset it, or set it to cpu"
    return ""


def exit_status(
    program: Callable[[], int],
    stopped: str = "stopped; the same command resumes where it was",
    memory: str = "not enough memory for one chunk of settings; give a smaller --memory",
) -> int:
    """Runs a program; turns what a user can mend into one line on stderr and an exit status that is not 0.

    0: done. 1: results could not be written. 2: wrong options. 3: done, but some results are not finite.
    130: stopped from the keyboard. 143: stopped by the system (SIGTERM). 141: nobody reads the output. After --help the status that the parser gives: 0.
    With HRCJAX_DEBUG=1 in the environment, tracebacks.

    Args:
        stopped: what to say after an interrupt.
        memory: what to say if there is not enough of it.
    """
    print_any_name()
    if sys.platform == "win32":
        print("error: Linux or macOS is needed; on Windows use its subsystem for Linux (WSL)", file=sys.stderr)
        return 2
    if os.environ.get("HRCJAX_DEBUG") == "1":
        return program()
    came: list[int] = []
    try:
        with _terminated_as_interrupt() as came:
            return program()
    except SystemExit as stop:
        return int(stop.code or 0)
    except UsageError as error:
        message, status = one_line(error), 2
    except StorageError as error:
        message, status = one_line(error), 1
    except BrokenPipeError:  # the reader of a pipe had enough; python would complain again at its end
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 141
    except KeyboardInterrupt as stop:
        message, status = stopped, 143 if isinstance(stop, Terminated) else 130
    except (MemoryError, RuntimeError, AssertionError) as error:
        if came:  # within a callback from compiled code, which makes an error of its own of it
            message, status = stopped, 143
        elif isinstance(error, MemoryError) or "RESOURCE_EXHAUSTED" in str(error):
            message, status = memory, 1
        elif text := _lacks_platform():
            message, status = text, 2
        else:
            raise
    print(f"error: {message}", file=sys.stderr, flush=True)
    return status
