"""The likelihood of a field's parameters: against densities of SciPy and explicit refits, slopes, clouds without information."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.stats import multivariate_normal, norm

from hrcjax.field.params import FieldParams
from hrcjax.geom.cloud import Cloud
from hrcjax.lab.errors import UsageError
from hrcjax.sim import Cell, Params, World
from hrcjax.sim.sensing import Frames
from hrcjax.tune import LOSSES, episode_terms
from hrcjax.tune.evidence import FRAMES, log_evidence, log_leave_one_out, some_frames

BOTH = (log_evidence, log_leave_one_out)
PARAMS = FieldParams(length_scale=0.05, noise=0.1)


def ball(count: int, places: int, seed: int = 0, dtype=jnp.float64) -> Cloud:
    """Points on a ball of 10 cm, and places without a point among them."""
    draw = np.random.default_rng(seed)
    x = draw.normal(size=(places, 3))
    mask = np.zeros(places, bool)
    mask[draw.permutation(places)[:count]] = True
    return Cloud(jnp.asarray(0.1 * x / np.linalg.norm(x, axis=1)[:, None], dtype), jnp.asarray(mask))


def covariance(x: np.ndarray, length_scale: float, noise: float) -> np.ndarray:
    r = np.linalg.norm(x[:, None] - x[None], axis=-1)
    return np.exp(-0.5 * (r / length_scale) ** 2) + noise**2 * np.eye(len(x))


@pytest.mark.parametrize(("length_scale", "noise"), [(0.05, 0.1), (0.02, 0.3), (0.2, 0.05)])
def test_evidence_is_the_density_of_the_targets(length_scale: float, noise: float) -> None:
    cloud = ball(20, 30)
    x = np.asarray(cloud.points)[np.asarray(cloud.mask)]
    density = multivariate_normal(np.zeros(20), covariance(x, length_scale, noise))  # pyright: ignore[reportArgumentType]
    expected = density.logpdf(np.ones(20))
    assert float(log_evidence(cloud, FieldParams(length_scale, noise))) == pytest.approx(expected, abs=1e-7)


def test_leave_one_out_is_the_sum_of_refits() -> None:
    cloud = ball(12, 15)
    x = np.asarray(cloud.points)[np.asarray(cloud.mask)]
    K, expected = covariance(x, 0.05, 0.1), 0.0
    for i in range(12):
        rest = np.arange(12) != i
        weights = np.linalg.solve(K[np.ix_(rest, rest)], K[rest, i])
        expected += norm.logpdf(1.0, weights.sum(), np.sqrt(K[i, i] - weights @ K[rest, i]))
    assert float(log_leave_one_out(cloud, PARAMS)) == pytest.approx(expected, abs=1e-7)


@pytest.mark.parametrize("of", BOTH)
def test_slopes_are_those_of_differences(of) -> None:
    cloud, step = ball(20, 30), 1e-6
    slope = jax.grad(lambda scale, noise: of(cloud, FieldParams(scale, noise)), argnums=(0, 1))(0.05, 0.1)
    for k, found in enumerate(slope):
        ends = [of(cloud, FieldParams(*np.add((0.05, 0.1), sign * step * np.eye(2)[k]))) for sign in (1, -1)]
        assert float(found) == pytest.approx(float(ends[0] - ends[1]) / (2 * step), rel=1e-5)


@pytest.mark.parametrize("dtype", [jnp.float32, jnp.float64])
@pytest.mark.parametrize("of", BOTH)
def test_finite_where_nothing_is_known(of, dtype) -> None:
    """No points; one; points that coincide; a length scale over all of them; none of the noise."""
    many = ball(200, 256, dtype=dtype)
    alike = Cloud(jnp.zeros_like(many.points), many.mask)
    both = jax.jit(jax.value_and_grad(lambda p, cloud: of(cloud, p)))
    for cloud in (many, alike, Cloud(many.points, many.mask & False), ball(1, 256, dtype=dtype)):
        for numbers in ((0.05, 0.1), (0.2, 0.01), (0.2, 0.0), (10.0, 0.0), (0.01, 0.0)):
            p = FieldParams(*(jnp.asarray(x, dtype) for x in numbers))
            value, slope = both(p, cloud)
            assert value.dtype == dtype and np.isfinite(value), numbers
            assert all(np.isfinite(g) for g in jax.tree.leaves(slope)), numbers
    assert float(of(Cloud(many.points, many.mask & False), PARAMS)) == 0


def test_targets_that_are_alike_ask_for_the_longest_scale() -> None:
    """With a covariance of 1 between all points the density is known: it grows without bound as the noise vanishes."""
    cloud, n = ball(40, 40), 40
    for of in BOTH:
        found = [float(of(cloud, FieldParams(scale, 0.1))) for scale in (0.01, 0.03, 0.1, 0.3, 1.0)]
        assert (np.diff(found) > 0).all()
    for noise in (0.1, 0.01):
        s2 = noise**2
        limit = -0.5 * (n / (n + s2) + np.log(n + s2) + (n - 1) * np.log(s2) + n * np.log(2 * np.pi))
        assert float(log_evidence(cloud, FieldParams(1e4, noise))) == pytest.approx(limit, rel=1e-6)


def empty(kind, **fields):
    """An object of a class with some of its fields."""
    made = object.__new__(kind)
    for name, value in fields.items():
        object.__setattr__(made, name, value)
    return made


NO_CELL = empty(Cell)


def frames(count: int) -> World:
    """A world with frames alone; every third is empty."""
    clouds = [ball(0 if k % 3 == 1 else 5 + k, 30, k) for k in range(count)]
    moving = jax.tree.map(lambda *a: jnp.stack(a), *clouds)
    return empty(World, frames=empty(Frames, moving=moving), q_start=jnp.zeros(6))


def test_losses_are_means_over_frames_and_trace_no_episode() -> None:
    """A cell without an arm would not survive an episode."""
    params = replace(Params(), field=PARAMS)
    chosen = (LOSSES["evidence"], LOSSES["leave_one_out"])
    for count in (3, 15):
        world = frames(count)
        taken = some_frames(world)
        assert taken.mask.shape[0] == min(count, FRAMES)
        np.testing.assert_array_equal(taken.points[-1], world.frames.moving.points[-1])
        found = episode_terms(NO_CELL, chosen)(params, world)
        for value, of in zip(found, BOTH, strict=True):
            clouds = [jax.tree.map(lambda a, k=k: a[k], taken) for k in range(taken.mask.shape[0])]
            each = [-float(of(c, PARAMS)) / int(c.mask.sum()) for c in clouds if bool(c.mask.any())]
            assert float(value) == pytest.approx(np.mean(each))


def test_a_field_of_another_kind_is_refused() -> None:
    with pytest.raises(UsageError, match="accepted: FieldParams"):
        LOSSES["evidence"].of(replace(Params(), field=0.1), NO_CELL, frames(1), None)  # pyright: ignore[reportArgumentType]
