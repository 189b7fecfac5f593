"""Resolution: the joint acceleration that a combined policy asks for."""

import equinox as eqx
import jax.numpy as jnp

from hrcjax.numerics import solve_spd
from hrcjax.policy.pullback import Pulled
from hrcjax.typing import Array, Float


class ResolveParams(eqx.Module):
    """Numbers of the resolution: those of the HRI paper's published program."""

    regularisation: float = 1e-3
    """Added to the diagonal of the scaled metric; draws directions that no leaf cares for to rest [1]."""
    scale: float = 0.01
    """The metric is divided by its largest entry times this, where that exceeds 1 [1]."""


def resolve(params: ResolveParams, pulled: Pulled) -> Float[Array, "joint"]:
    """The qdd [rad/s^2] of (M / s + r I) qdd = f / s, with s = max(1, scale max|M|).

    Not finite if: r is 0 and M singular.

    Source: the HRI paper's system, see docs/references.md.
    """
    # The largest entry of a positive semi-definite matrix is on its diagonal.
    s = jnp.maximum(params.scale * jnp.max(jnp.diagonal(pulled.M)), 1.0)
    regular = params.regularisation * jnp.eye(pulled.f.shape[0], dtype=pulled.M.dtype)
    return solve_spd(pulled.M / s + regular, pulled.f / s)
