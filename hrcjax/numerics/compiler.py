"""Options of XLA for programs of many scalars, such as a control tick and its derivative."""

import jax

LLVM_LEVEL = 1
"""How much LLVM tries."""


def unrolled_options() -> dict[str, str | bool]:
    """Compiler options for a whole closed-loop program, for `jax.jit(f, compiler_options=...)`; empty but on a CPU.

    XLA's fusion emitters for the CPU compute shared terms of deep expressions over and over; without them, and with
    LLVM at level 1, a batch of control ticks compiles and runs in two thirds of the time, and its derivative compiles
    in a third. Single deep-free programs, such as queries of a field, do better without these options.
    """
    if jax.default_backend() != "cpu":
        return {}
    return {
        "xla_cpu_use_fusion_emitters": False,
        "xla_backend_optimization_level": str(LLVM_LEVEL),
        "xla_disable_hlo_passes": "cse_barrier_expander",
    }
