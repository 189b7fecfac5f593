"""The mass that a contact feels, for every control point and surface of people near it, with what the hand carries.

Effective mass of Khatib (1995), 1 / (u^T J M^-1 J^T u): instead of half of the arm's mass, as the standard's rule has it.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from hrcjax.numerics import safe_divide, solve_spd
from hrcjax.typing import Array, Bool, Float, Scalar


class ContactMobility(eqx.Module):
    """What is needed for one over the mass that a push feels at every row: a control point towards a surface near it."""

    M: Float[Array, "joint joint"]
    """Inertia of the arm at its joints [kg m^2]."""
    J_payload: Float[Array, "3 joint"]
    """Jacobian of the place where the payload sits [m]."""
    A: Float[Array, "row joint"]
    """u^T J of every point in the direction u of its surface, either sign; 0 without direction [m]."""
    before: Float[Array, "row joint"]
    """u^T J of the control point before it on the link, in the same direction; its own where there is none [m]."""
    after: Float[Array, "row joint"]
    """The same of the one after it [m]."""
    counts: Bool[Array, "row"]
    """False for a surface that is far and has no direction: it must not decide anything."""

    def __call__(self, payload: Scalar) -> Float[Array, "row"]:
        """1/m_R of every row: the least between the middles of the ways to its neighbours on the link [1/kg].

        A surface that is near and has no direction gets 0, the mobility of the heaviest direction of an arm that can't give way in
        some: a lower bound for any direction. Rows that do not count get the largest of the others.

        Args:
            payload: m_L, a point mass at the tool point [kg].

        Not finite if: M is singular.
        """
        joints = self.M.shape[0]
        M = self.M + payload * (self.J_payload.T @ self.J_payload)
        inverse = jax.vmap(solve_spd, in_axes=(None, 0))(M, jnp.eye(joints, dtype=M.dtype))
        own = self.A @ inverse
        mobility = jnp.minimum(self._towards(self.before, own, inverse), self._towards(self.after, own, inverse))
        return jnp.where(self.counts, mobility, jnp.max(jnp.where(self.counts, mobility, 0.0)))

    def _towards(
        self, neighbour: Float[Array, "row joint"], own: Float[Array, "row joint"], inverse: Float[Array, "joint joint"]
    ) -> Float[Array, "row"]:
        """The least mobility from the point to the middle of the way to a neighbour: on a rigid link u^T J is linear [1/kg]."""
        change = neighbour - self.A
        here, slope = jnp.sum(self.A * own, axis=-1), jnp.sum(change * own, axis=-1)
        bend = jnp.sum(change * (change @ inverse), axis=-1)
        # where the least is, has no part in its derivative
        s = jnp.clip(jax.lax.stop_gradient(safe_divide(-slope, bend)), 0.0, 0.5)
        return jnp.maximum(here + s * (2 * slope + s * bend), 0.0)


def link_neighbours(links: tuple[int, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Index of the control point before and after every one on the same link; its own where there is none.

    Args:
        links: of the control points, in order along the arm.
    """
    own, of = np.arange(len(links)), np.asarray(links)
    same = of[1:] == of[:-1]
    return own - np.append(False, same), own + np.append(same, False)
