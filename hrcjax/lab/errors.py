"""Errors that a program reports in one line instead of a traceback."""

import contextlib
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator

import jax

from hrcjax.lab.any_name import print_any_name


class UsageError(ValueError):
    """An invalid name, value, file or combination of options. The message is one line: what is wrong, what is accepted."""


class StorageError(OSError):
    """Results could not be written: disk full, permission denied. Results finished before are kept."""


def one_line(error: BaseException) -> str:
    """The message of an error without line breaks, or the name of its type."""
    return " ".join(str(error).split()) or type(error).__name__


class Terminated(KeyboardInterrupt):
    """SIGTERM, handled as Ctrl-C, so that finished results are kept."""


@contextlib.contextmanager
def _terminated_as_interrupt() -> Iterator[list[int]]:
    """Raises `Terminated` on SIGTERM, unless a handler is installed already; yields the list of signals received."""
    came: list[int] = []
    main = threading.current_thread() is threading.main_thread()  # only the main thread receives signals
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
    """Error message if the platform in JAX_PLATFORMS is not available; "": it is."""
    asked = os.environ.get("JAX_PLATFORMS", "")
    if asked:
        try:
            jax.devices()
        except Exception as error:  # an assertion without words, or a runtime error
            said = str(error).split(" (set JAX_PLATFORMS")[0]  # JAX's own advice
            reason = f" ({' '.join(said.split()).rstrip('.')})" if said else ""
            return f"JAX_PLATFORMS={asked} in the environment: not available here{reason}; unset it, or set it to cpu"
    return ""


def exit_status(
    program: Callable[[], int],
    stopped: str = "stopped; the same command resumes the run",
    memory: str = "not enough memory for one chunk of settings; give a smaller --memory",
) -> int:
    """Runs a program; turns errors that a user can fix into one line on stderr and a non-zero exit status.

    0: done, or --help. 1: results could not be written. 2: invalid options. 3: done, but some results are not finite.
    130: Ctrl-C. 143: SIGTERM. 141: the output pipe was closed.
    With HRCJAX_DEBUG=1 in the environment, tracebacks.

    Args:
        stopped: message after an interrupt.
        memory: message if memory is exhausted.
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
    except BrokenPipeError:  # the reader closed the pipe; Python would report it again at exit
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
