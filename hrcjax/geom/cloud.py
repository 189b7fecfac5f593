"""A point cloud of fixed capacity."""

import equinox as eqx

from hrcjax.typing import Array, Bool, Float


class Cloud(eqx.Module):
    """Points of which only those under the mask exist; the others have finite, meaningless coordinates."""

    points: Float[Array, "*batch point 3"]
    """Positions in the world [m]."""
    mask: Bool[Array, "*batch point"]
    """True where a point exists."""
