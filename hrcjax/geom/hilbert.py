"""Order of places along a Hilbert curve: neighbours on it are neighbours in space, without the jumps of a Morton curve.

Source: J. Skilling, Programming the Hilbert curve, AIP Conf. Proc. 707 (2004).
"""

import jax.numpy as jnp

from hrcjax.typing import Array, Int


def hilbert_index(cells: Int[Array, "point 3"], bits: int) -> Int[Array, "point"]:
    """Place of every cell along the curve through all cells of a cube.

    Args:
        cells: from 0 to 2^bits - 1.
        bits: at most 10.
    """
    a = [cells[:, i] for i in range(3)]
    for level in reversed(range(1, bits)):
        q, p = 1 << level, (1 << level) - 1
        for i in range(3):
            swap = (a[0] ^ a[i]) & p
            turned = (a[i] & q) != 0
            first = jnp.where(turned, a[0] ^ p, a[0] ^ swap)
            a[i] = a[i] if i == 0 else jnp.where(turned, a[i], a[i] ^ swap)
            a[0] = first
    a[1] = a[1] ^ a[0]  # Gray code
    a[2] = a[2] ^ a[1]
    t = jnp.zeros_like(a[0])
    for level in reversed(range(1, bits)):
        t = jnp.where((a[2] & (1 << level)) != 0, t ^ ((1 << level) - 1), t)
    x, y, z = (_every_third(v ^ t) for v in a)
    return (x << 2) | (y << 1) | z


def _every_third(v: Array) -> Array:
    """The ten lowest bits, with two zeros after each."""
    for shift, mask in ((16, 0x030000FF), (8, 0x0300F00F), (4, 0x030C30C3), (2, 0x09249249)):
        v = (v | (v << shift)) & mask
    return v
