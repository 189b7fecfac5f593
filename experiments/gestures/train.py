"""Training of the classifier: seconds of Adam with decay of the weights, on hands changed by chance."""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from hrcjax.hand import NONE, Classifier, pair_distances
from hrcjax.lab.errors import UsageError
from hrcjax.typing import Array, PRNGKeyArray

from .data import Hands
from .unlike import other_fingers


@dataclass(frozen=True)
class Recipe:
    """Hyperparameters, chosen by `train --choose` on inner blocks."""

    hidden: tuple[int, ...] = (64,)
    """Units of the hidden layers."""
    steps: int = 1500
    """Steps of the optimiser."""
    batch: int = 192
    """Hands of a step; a third as many of each kind of what is no gesture besides."""
    rate: float = 3e-3
    """Largest step size, which falls to 0 by a cosine."""
    decay: float = 1e-3
    """Decay of the weights (AdamW)."""
    noise: float = 0.08
    """Largest noise of a landmark, over the hand's size."""
    squeeze: float = 0.5
    """Largest shortening along one direction, as of a hand that turns out of the image."""
    others: int = 3000
    """Hands with other fingers extended; 0: none."""


def optimiser():
    """The module optax.

    Raises:
        UsageError: it is not installed.
    """
    try:
        import optax
    except ImportError as error:
        raise UsageError("training needs optax: pip install 'hrcjax[perception]'") from error
    return optax


def _varied(key: PRNGKeyArray, x: Array, recipe: Recipe) -> Array:
    """Hands shortened along a direction, with noise."""
    direction, share, level, noise = jax.random.split(key, 4)
    n, x = len(x), x - jnp.mean(x, axis=1, keepdims=True)
    size = jnp.max(jnp.abs(x), axis=(1, 2), keepdims=True)
    angle = jax.random.uniform(direction, (n,), x.dtype, 0.0, jnp.pi)
    along = jnp.stack([jnp.cos(angle), jnp.sin(angle)], axis=-1)
    lost = recipe.squeeze * jax.random.uniform(share, (n, 1, 1), x.dtype)
    x = x - lost * (x @ along[:, :, None]) * along[:, None, :]
    level_of = recipe.noise * jax.random.uniform(level, (n, 1, 1), x.dtype)
    return x + level_of * size * jax.random.normal(noise, x.shape, x.dtype)


def _unlike(key: PRNGKeyArray, x: Array) -> Array:
    """Shuffled landmarks, points by chance, and hands under heavy noise."""
    order, place, level, noise = jax.random.split(key, 4)
    n, x = len(x), x - jnp.mean(x, axis=1, keepdims=True)
    size = jnp.max(jnp.abs(x), axis=(1, 2), keepdims=True)
    mixed = jnp.take_along_axis(x, jnp.argsort(jax.random.uniform(order, x.shape[:2]), axis=1)[:, :, None], axis=1)
    points = jax.random.uniform(place, x.shape, x.dtype, -1.0, 1.0)
    heavy = x + jax.random.uniform(level, (n, 1, 1), x.dtype, 0.2, 0.5) * size * jax.random.normal(
        noise, x.shape, x.dtype
    )
    return jnp.concatenate([mixed, points, heavy])


def _layers(key: PRNGKeyArray, sizes: tuple[int, ...]) -> tuple[tuple[Array, ...], tuple[Array, ...]]:
    """Weights by He's rule, and biases of 0."""
    keys = jax.random.split(key, len(sizes) - 1)
    shapes = list(pairwise(sizes))
    weights = tuple(
        jax.random.normal(k, s, jnp.float32) * np.float32((2 / s[0]) ** 0.5) for k, s in zip(keys, shapes, strict=True)
    )
    return weights, tuple(jnp.zeros(s[1], jnp.float32) for s in shapes)


def fit(hands: Hands, recipe: Recipe, seed: int = 0) -> Classifier:
    """A classifier of these hands: open, closed, pointing, and none for what is unlike them.

    Raises:
        UsageError: optax is not installed.
    """
    optax = optimiser()
    x, gesture = jnp.asarray(hands.x, jnp.float32), jnp.asarray(hands.gesture)
    others = other_fingers(hands, np.random.default_rng(seed), recipe.others) if recipe.others else np.zeros((0, 21, 2))
    other = jnp.asarray(others, jnp.float32)
    features = jax.vmap(pair_distances)(x)
    first, steps = jax.random.split(jax.random.key(seed, impl="rbg"))
    weights, biases = _layers(first, (features.shape[1], *recipe.hidden, 4))
    model = Classifier(jnp.mean(features, axis=0), jnp.std(features, axis=0) + jnp.float32(1e-3), weights, biases)
    schedule = optax.cosine_decay_schedule(recipe.rate, recipe.steps)
    rule = optax.adamw(schedule, weight_decay=recipe.decay)
    third = max(recipe.batch // 3, 1)

    def loss(layers: tuple, key: PRNGKeyArray) -> Array:
        pick, vary, scramble, take, change = jax.random.split(key, 5)
        net = Classifier(model.mean, model.spread, *layers)
        rows = jax.random.randint(pick, (recipe.batch,), 0, len(x))
        inputs = [_varied(vary, x[rows], recipe), _unlike(scramble, x[rows[:third]])]
        if len(other):
            more = other[jax.random.randint(take, (third,), 0, len(other))]
            inputs.append(_varied(change, more, recipe))
        sample = jnp.concatenate(inputs)
        none = jnp.full(len(sample) - recipe.batch, NONE, gesture.dtype)
        logits = jax.vmap(net.logits)(sample)
        wrong = optax.softmax_cross_entropy_with_integer_labels(logits, jnp.concatenate([gesture[rows], none]))
        return jnp.mean(wrong[: recipe.batch]) + jnp.float32(0.5) * jnp.mean(wrong[recipe.batch :])

    def step(carry: tuple, key: PRNGKeyArray) -> tuple[tuple, None]:
        layers, memory = carry
        change, memory = rule.update(jax.grad(loss)(layers, key), memory, layers)
        return (optax.apply_updates(layers, change), memory), None

    layers = (weights, biases)
    run = jax.jit(lambda carry, keys: jax.lax.scan(step, carry, keys)[0])
    (weights, biases), _ = run((layers, rule.init(layers)), jax.random.split(steps, recipe.steps))
    return Classifier(model.mean, model.spread, weights, biases)


def plain_network(hands: Hands, steps: int = 3000, seed: int = 0) -> Callable[[NDArray], NDArray]:
    """A plain network of 42 coordinates, 32 units and 3 classes, as trained; the reference of the rows.

    Its input are coordinates about the wrist over the greatest one; nothing is varied.

    Returns:
        (x of shape (row, 21, 2)) -> probabilities (row, 3).
    """
    optax = optimiser()

    def inputs(x: NDArray) -> Array:
        x = x - x[:, :1]
        return jnp.asarray((x / np.abs(x).max(axis=(1, 2), keepdims=True)).reshape(len(x), -1), jnp.float32)

    data, gesture = inputs(hands.x), jnp.asarray(hands.gesture)
    first, keys = jax.random.split(jax.random.key(seed, impl="rbg"))
    layers = _layers(first, (42, 32, 3))
    rule = optax.adam(optax.cosine_decay_schedule(3e-3, steps))

    def logits(layers: tuple, f: Array) -> Array:
        (w, v), (b, c) = layers
        return jax.nn.relu(f @ w + b) @ v + c

    def loss(layers: tuple, key: PRNGKeyArray) -> Array:
        rows = jax.random.randint(key, (128,), 0, len(data))
        return jnp.mean(optax.softmax_cross_entropy_with_integer_labels(logits(layers, data[rows]), gesture[rows]))

    def step(carry: tuple, key: PRNGKeyArray) -> tuple[tuple, None]:
        layers, memory = carry
        change, memory = rule.update(jax.grad(loss)(layers, key), memory, layers)
        return (optax.apply_updates(layers, change), memory), None

    run = jax.jit(lambda carry, keys: jax.lax.scan(step, carry, keys)[0])
    layers, _ = run((layers, rule.init(layers)), jax.random.split(keys, steps))
    return lambda x: np.asarray(jax.nn.softmax(logits(layers, inputs(x))))
