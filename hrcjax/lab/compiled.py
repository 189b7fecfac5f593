"""The compilation cache between runs."""

import os
from pathlib import Path

import jax


def keep_compiled() -> None:
    """Enables JAX's compilation cache, unless the user has configured it."""
    if jax.config.jax_compilation_cache_dir is None and "JAX_COMPILATION_CACHE_DIR" not in os.environ:  # pyright: ignore[reportAttributeAccessIssue]  # set at run time
        cache = Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "hrcjax" / "xla"
        jax.config.update("jax_compilation_cache_dir", str(cache))
