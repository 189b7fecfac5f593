"""Reasons as bits of one integer, so that a compiled program can return any set of them, with a text for each.

A package names its bits as constants 1, 2, 4 ... with a table bit -> text.
"""

from collections.abc import Mapping

import jax.numpy as jnp

from hrcjax.typing import Array, Bool, Int


def pack(conditions: Mapping[int, Bool[Array, "..."] | bool]) -> Int[Array, "..."]:
    """The bits whose conditions hold, as int32; conditions of any shapes that broadcast."""
    found = jnp.zeros((), jnp.int32)
    for bit, holds in conditions.items():
        found = found | jnp.where(holds, bit, 0).astype(jnp.int32)
    return found


def words(meanings: Mapping[int, str], bits: int) -> str:
    """What the bits mean, in the order of the table; "none" for 0. A bit without a meaning is named by its number."""
    bits = int(bits)
    texts = [text for bit, text in meanings.items() if bits & bit]
    unknown = bits & ~sum(meanings)
    return "; ".join([*texts, *([f"unknown bits {unknown}"] if unknown else [])]) or "none"
