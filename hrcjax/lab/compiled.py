"""The compilation cache between runs, and what compiling leaves behind."""

import ctypes
import gc
import os
import sys
from pathlib import Path

import jax


def keep_compiled() -> None:
    """Enables JAX's compilation cache, unless the user has configured it."""
    if jax.config.jax_compilation_cache_dir is None and "JAX_COMPILATION_CACHE_DIR" not in os.environ:  # pyright: ignore[reportAttributeAccessIssue]  # set at run time
        cache = Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "hrcjax" / "xla"
        jax.config.update("jax_compilation_cache_dir", str(cache))


def give_memory_back() -> None:
    """Drops what tracing and compiling left behind, some hundred megabytes for a map: traced programs, and freed pages that the C
    library keeps. Programs that the caller holds stay compiled; other jitted functions are traced again at their next call."""
    jax.clear_caches()
    gc.collect()
    if sys.platform == "linux":
        libc = ctypes.CDLL(None)
        if hasattr(libc, "malloc_trim"):  # of glibc
            libc.malloc_trim(0)
