"""A jit for tests that run a program a few times: it compiles several times faster than the default."""

from collections.abc import Callable
from typing import Any

import jax


def quick_jit(f: Callable[..., Any]) -> Callable[..., Any]:
    """jax.jit without the optimisations that unrolled code pays dearly for at compile time."""
    return jax.jit(f, compiler_options={"xla_backend_optimization_level": 0, "xla_cpu_use_fusion_emitters": False})
