"""The flag of XLA without which the pinned jax is wrong on a CPU."""

import os
import sys
import warnings
from pathlib import Path

OPTION = "xla_cpu_experimental_ynn_fusion_type"
"""Which operations XLA hands over to the library YNNPACK, separated by commas; -NAME: all of its own but this."""
VALUE = "-reduce"
"""Products stay with the library, which is some 20 % faster in queries of a map than handing over nothing."""


def switch_off_ynnpack() -> None:
    """Adds `--xla_cpu_experimental_ynn_fusion_type=-reduce` to the variable `XLA_FLAGS`; run when `hrcjax` is imported.

    XLA of jaxlib 0.10.2 hands sums over to YNNPACK on a CPU and gets some of them wrong, without a word: a matrix times
    each of 40,961 rows, squared and summed, is wrong in 8,192 of them (jax issue 39103). XLA reads its flags once, when
    the first backend starts. A flag for this option that is there already stays as it is.

    Warns:
        RuntimeWarning: a CPU backend was started before, so that the flag comes too late for this process; or
            `XLA_FLAGS` names a file, which has no line for this option.
    """
    flags = os.environ.get("XLA_FLAGS", "").strip()
    if flags and not flags.startswith("-"):  # the name of a file with flags
        file = Path(flags)
        if not (file.is_file() and OPTION in file.read_text(encoding="utf-8", errors="replace")):
            warnings.warn(
                f"jax 0.10.2 is wrong on a CPU: add a line --{OPTION}={VALUE} to {flags}", RuntimeWarning, stacklevel=3
            )
        return
    if OPTION in flags:
        return
    os.environ["XLA_FLAGS"] = f"{flags} --{OPTION}={VALUE}".strip()
    bridge = sys.modules.get("jax._src.xla_bridge")
    if bridge is not None and bridge.backends_are_initialized() and sys.modules["jax"].default_backend() == "cpu":
        warnings.warn(
            "jax 0.10.2 is wrong on a CPU without a flag that hrcjax sets, and jax has computed already: import hrcjax "
            f"before the first computation, or set XLA_FLAGS=--{OPTION}={VALUE} yourself",
            RuntimeWarning,
            stacklevel=3,
        )
