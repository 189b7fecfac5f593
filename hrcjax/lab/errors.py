"""What a program tells its user in one line instead of a traceback."""

import os
import sys
from collections.abc import Callable

import jax


class UsageError(ValueError):
    """A wrong name, value, file or mix of options. The message is one line: what was wrong, what is accepted."""


class StorageError(OSError):
    """Results could not be written: a full disk, a missing right. What was finished before is still there."""


def one_line(error: BaseException) -> str:
    """The message of an error without line breaks; the name of its type if it has none."""
    return " ".join(str(error).split()) or type(error).__name__


def exit_status(
    program: Callable[[], int],
    stopped: str = "stopped; the same command resumes where it was",
    memory: str = "not enough memory for one chunk of settings; give a smaller --memory",
) -> int:
    """Runs a program; turns what a user can mend into one line on stderr and an exit status that is not 0.

    0: done. 1: results could not be written. 2: wrong options. 3: done, but some results are not finite.
    130: stopped from the keyboard. 141: nobody reads the output. After --help the status that the parser gives: 0.
    With HRCJAX_DEBUG=1 in the environment, tracebacks.

    Args:
        stopped: what to say after an interrupt.
        memory: what to say if there is not enough of it.
    """
    if os.environ.get("HRCJAX_DEBUG") == "1":
        return program()
    try:
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
    except KeyboardInterrupt:
        message, status = stopped, 130
    except (MemoryError, jax.errors.JaxRuntimeError) as error:
        if not isinstance(error, MemoryError) and "RESOURCE_EXHAUSTED" not in str(error):
            raise
        message, status = memory, 1
    print(f"error: {message}", file=sys.stderr, flush=True)
    return status
