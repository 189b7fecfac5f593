"""Targets of the rows of the benchmarks."""

BARS = {
    "arm": {
        "ratio_to_mujoco_rollout": (">=", 4.0),
        "ratio_to_mjx_step": (">=", 6.0),
        "compile_s": ("<", 10.0),
    },
    "field": {
        "value_ratio_to_exp": ("<=", 3.0),
        "value_grad_ratio_to_exp": ("<=", 6.0),
    },
    "grad": {
        "ratio_to_forward": ("<=", 3.0),
        "compile_s": ("<=", 35.0),
        "new_loss_s": ("<=", 3.0),
        "new_sound_loss_s": ("<=", 3.0),
        "second_process_s": ("<=", 6.0),
    },
    "horizon": {
        **{f"error_{length}": ("<=", 1e-3) for length in ("1_s", "10_s", "30_s")},
        **{f"not_finite_{length}": ("<=", 0.0) for length in ("1_s", "10_s", "30_s")},
    },
    "sweep": {"ratio_to_serial": (">=", 15.0)},
    "tick": {"p50_ms": ("<", 1.0), "p99_ms": ("<", 2.0), "command_p99_ms": ("<", 45.0), "refused": ("<=", 0.0)},
    "map": {
        "p95_ms": ("<", 33.0),
        "growth_ratio": ("<=", 1.25),
        "query_18_ms": ("<", 0.3),
        "query_ratio_to_exp": ("<=", 4.0),
    },
    "plan": {"settings_per_s": (">=", 500.0)},
    "scale": {"results_peak_mb": ("<", 2147.0), "figures_peak_mb": ("<", 2147.0)},
}
"""Section -> row -> target of its value."""
