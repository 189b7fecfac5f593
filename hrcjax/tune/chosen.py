"""The parameters that are tuned: chosen by name, with bounds, as one vector of coordinates without bounds."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from hrcjax.lab.errors import UsageError
from hrcjax.lab.parameters import leaf_names, resolve, set_leaves
from hrcjax.tune.bounds import Bounds
from hrcjax.typing import Array, Float


@dataclass(frozen=True)
class Chosen:
    """Chosen parameters in order."""

    names: tuple[str, ...]
    """Dotted."""
    bounds: tuple[Bounds, ...]
    """Of each."""
    starts: tuple[float, ...]
    """Value of each at the start, within the bounds."""

    def start(self) -> NDArray[np.float64]:
        """The vector of the start values."""
        with jax.enable_x64(True):
            each = zip(self.bounds, self.starts, strict=True)
            return np.array([float(b.to_free(jnp.asarray(x, jnp.float64))) for b, x in each])

    def values(self, vector: Float[Array, "parameter"]) -> Float[Array, "parameter"]:
        """The parameters at a vector."""
        return jnp.stack([b.from_free(z) for b, z in zip(self.bounds, vector, strict=True)])

    def params(self, base: Any, vector: Float[Array, "parameter"]) -> Any:
        """`base` with the chosen parameters of a vector; every number in the vector's dtype."""
        named = dict(zip(self.names, self.values(vector), strict=True))
        return jax.tree.map(lambda leaf: jnp.asarray(leaf, vector.dtype), set_leaves(base, named))

    def drawn(self, key: Array, vector: Float[Array, "parameter"], spread: float) -> Float[Array, "parameter"]:
        """Another start: anywhere between two bounds, uniform in x or, where low > 0, in its logarithm; otherwise a normal
        distribution of the coordinate about the vector, with a deviation of `spread` [1]."""
        near, far = vector + spread * jax.random.normal(key, vector.shape, vector.dtype), _logistic(key, vector)
        return jnp.where(np.array([np.isfinite([b.low, b.high]).all() for b in self.bounds]), far, near)


def _logistic(key: Array, like: Float[Array, "parameter"]) -> Float[Array, "parameter"]:
    """The coordinate of a uniform share between two bounds, 2 % away from them."""
    u = jax.random.uniform(key, like.shape, like.dtype, 0.02, 0.98)
    return jnp.log(u) - jnp.log1p(-u)


def choose(
    words: Sequence[str],
    params: Any,
    aliases: Mapping[str, str],
    domains: Mapping[str, tuple[float, float]],
    frozen: Collection[str] = (),
) -> Chosen:
    """Parameters from words NAME, NAME=LOW:HIGH or NAME=LOW:HIGH:START.

    Args:
        words: a NAME is a dotted name, an alias, a unique ending, or the start of dotted names, which chooses all below.
        params: their values are the starts.
        domains: bounds where a word gives none, and what given ones must lie within.
        frozen: names of the same forms, left out.

    Raises:
        UsageError: an unknown name, one given twice, bounds or a start that are not accepted, nothing left.
    """
    leaves = leaf_names(params)
    out = {full for name in frozen for full in _below(name, leaves, aliases)}
    found: dict[str, tuple[Bounds, float]] = {}
    for word in words:
        name, equals, rest = word.partition("=")
        for full in _below(name.strip(), leaves, aliases):
            if full in found:
                raise UsageError(f"--params {word}: {full} is chosen twice")
            found[full] = _limits(word, rest if equals else "", leaves[full], domains.get(full, (-np.inf, np.inf)))
    kept = {full: entry for full, entry in found.items() if full not in out}
    for full, (bounds, start) in kept.items():
        if not bounds.inside(start):
            low, high = bounds.low, bounds.high
            raise UsageError(
                f"--params: {full} starts at {start:g}, not between {low:g} and {high:g}; accepted: NAME=LOW:HIGH:START, or --frozen {full}"
            )
    if not kept:
        raise UsageError("--params: no parameter is left; accepted are one or more that are not in --frozen")
    return Chosen(tuple(kept), tuple(b for b, _ in kept.values()), tuple(x for _, x in kept.values()))


def _below(name: str, leaves: Mapping[str, float], aliases: Mapping[str, str]) -> list[str]:
    """The parameter of a name, or all below the start of dotted names."""
    group = [full for full in leaves if full.startswith(name + ".")]
    return group if group else [resolve(name, leaves, aliases)]


def _limits(word: str, text: str, default: float, domain: tuple[float, float]) -> tuple[Bounds, float]:
    """Bounds and start of a word; `text` is what stands after its "="."""
    try:
        numbers = [float(part) for part in text.split(":")] if text else list(domain)
        if not 2 <= len(numbers) <= 3 or np.isnan(numbers).any():
            raise ValueError
        bounds = Bounds(*numbers[:2])
    except ValueError:
        raise UsageError(f"--params {word}: accepted: NAME, NAME=LOW:HIGH or NAME=LOW:HIGH:START, LOW < HIGH") from None
    if bounds.low < domain[0] or bounds.high > domain[1]:
        raise UsageError(f"--params {word}: accepted are bounds within {domain[0]:g}:{domain[1]:g}")
    return bounds, numbers[2] if len(numbers) > 2 else default
