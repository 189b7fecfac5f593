"""A small network from the features of a hand to the probabilities of its gestures."""

import equinox as eqx
import jax
import jax.numpy as jnp

from hrcjax.hand.features import pair_distances
from hrcjax.typing import Array, Float


class Classifier(eqx.Module):
    """Weights of a network with rectified hidden layers."""

    mean: Float[Array, "feature"]
    """Mean of each feature over the training data [1]."""
    spread: Float[Array, "feature"]
    """Their standard deviation [1]."""
    weights: tuple[Float[Array, "_ _"], ...]
    """Of each layer, from input to output [1]."""
    biases: tuple[Float[Array, "_"], ...]
    """Of each layer [1]."""

    def logits(self, x: Float[Array, "landmark 2"]) -> Float[Array, "gesture"]:
        """Logarithms of the probabilities of a hand's gestures, up to a constant."""
        f = (pair_distances(x) - self.mean) / self.spread
        for w, b in zip(self.weights[:-1], self.biases[:-1], strict=True):
            f = jax.nn.relu(f @ w + b)
        return f @ self.weights[-1] + self.biases[-1]

    def probabilities(self, x: Float[Array, "landmark 2"]) -> Float[Array, "gesture"]:
        """Probabilities of open, closed, pointing and none, in this order [1]. Not finite if: a landmark is not."""
        return jax.nn.softmax(self.logits(x))


def calibration_error(probability: Float[Array, "sample gesture"], gesture: Array, bins: int = 15) -> Float[Array, ""]:
    """Expected calibration error (Guo et al., ICML 2017, eq. 3): mean gap between confidence and accuracy [1].

    Samples are put into bins of equal width by the probability of their likeliest gesture; the gaps between its mean and
    the share that is right are weighted by the number of samples.

    Args:
        gesture: the true ones, of shape (sample,).
    """
    confidence = jnp.max(probability, axis=1)
    right = (jnp.argmax(probability, axis=1) == gesture).astype(probability.dtype)
    place = jnp.minimum(jnp.floor(confidence * bins), bins - 1).astype(jnp.int32)
    gap = jnp.zeros(bins, probability.dtype).at[place].add(confidence - right)
    return jnp.sum(jnp.abs(gap)) / len(probability)
