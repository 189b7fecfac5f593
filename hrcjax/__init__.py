"""Human-robot collaboration as one differentiable program.

Distance fields learned from depth, Riemannian motion policies, potential fields and speed-and-separation safety for a
UR5, as pure functions that batch with `jax.vmap` and differentiate with `jax.grad`. Research software, not safety-rated.
"""

from hrcjax.xla_flags import switch_off_ynnpack

switch_off_ynnpack()  # before XLA reads its flags

__version__ = "0.1.0"
