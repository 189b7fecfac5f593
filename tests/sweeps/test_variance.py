"""Sobol indices against closed forms, SciPy's estimator and least squares."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import sobol_indices as estimated
from scipy.stats import uniform

from hrcjax.sweeps.variance import main_effects, sobol_indices


def grid(*sizes: int) -> list[np.ndarray]:
    """Midpoints of equal parts of (0, 1) along each axis."""
    return list(np.meshgrid(*((np.arange(n) + 0.5) / n for n in sizes), indexing="ij"))


def ishigami(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
    x, y, z = (2 * np.pi * u - np.pi for u in (x, y, z))
    return np.sin(x) + 7 * np.sin(y) ** 2 + 0.1 * z**4 * np.sin(x)


def test_ishigami_function() -> None:
    """Closed form: Ishigami and Homma 1990."""
    first, total = sobol_indices(ishigami(*grid(60, 50, 70)))
    np.testing.assert_allclose(first, [0.3139, 0.4424, 0.0], atol=1e-3)
    np.testing.assert_allclose(total, [0.5576, 0.4424, 0.2437], atol=1e-3)


def test_product_against_the_estimator_of_scipy() -> None:
    def f(x: np.ndarray) -> np.ndarray:
        return (1 + x[0]) * (1 + 3 * x[1] ** 2) + 0.3 * x[2]

    found = estimated(func=f, n=8192, dists=[uniform()] * 3, rng=0)
    first, total = sobol_indices(f(np.stack(grid(40, 40, 40))))
    np.testing.assert_allclose(first, found.first_order, atol=0.01)
    np.testing.assert_allclose(total, found.total_order, atol=0.01)


def test_additive_function_has_no_interactions() -> None:
    x, y, z = grid(4, 5, 6)
    values = 3 * x + np.sin(9 * y) + 0 * z
    first, total = sobol_indices(values)
    share = np.var(3 * x) / np.var(values)
    np.testing.assert_allclose(first, [share, 1 - share, 0], atol=1e-12)
    np.testing.assert_allclose(total, first, atol=1e-12)


def test_pure_interaction() -> None:
    x, y = grid(4, 6)
    first, total = sobol_indices((x - 0.5) * (y - 0.5))
    np.testing.assert_allclose([first, total], [[0, 0], [1, 1]], atol=1e-12)


def test_nothing_changes() -> None:
    for values in (np.full((3, 4), 2.0), np.zeros((3, 4))):
        np.testing.assert_array_equal(sobol_indices(values), np.zeros((2, 2)))
    nearly = 5 + 1e-7 * np.arange(12.0).reshape(3, 4)
    assert sobol_indices(nearly)[0].sum() > 0.9 and sobol_indices(nearly, negligible=1e-6)[0].sum() == 0
    with pytest.raises(ValueError, match="no point"):
        sobol_indices(nearly, np.zeros((3, 4), bool))


def test_gaps_do_not_make_one_input_look_like_another() -> None:
    """The second input does nothing; it has values only where the first is large."""
    x, y = grid(6, 6)
    good = (y < 0.5) | (x > 0.5)
    values = np.where(good, x**2, np.nan)
    first, total = sobol_indices(values, good)
    np.testing.assert_allclose([first, total], [[1, 0], [1, 0]], atol=1e-6)


def test_a_value_without_any_point_is_left_out() -> None:
    x, y = grid(5, 4)
    good = x < 0.9
    np.testing.assert_allclose(sobol_indices(np.where(good, x + y, 99.0), good), sobol_indices((x + y)[:4]), atol=1e-12)


@settings(deadline=None, max_examples=25)
@given(st.integers(0, 10_000), st.floats(0.4, 0.95))
def test_main_effects_are_the_least_squares_fit(seed: int, share: float) -> None:
    random = np.random.default_rng(seed)
    shape = (4, 3, 3)
    values, good = random.normal(size=shape), random.uniform(size=shape) < share
    good[:, 0, 0] = good[0, :, 0] = good[0, 0, :] = True  # all values of every axis are joined
    columns = [np.arange(n) == np.indices(shape)[k].reshape(-1, 1) for k, n in enumerate(shape)]
    design = np.concatenate(columns, axis=1).astype(float)
    solution, *_ = np.linalg.lstsq(design[good.ravel()], values[good], rcond=None)
    np.testing.assert_allclose(main_effects(values, good).ravel(), design @ solution, atol=1e-5)


@settings(deadline=None, max_examples=25)
@given(st.integers(0, 10_000), st.floats(0.5, 1.0))
def test_indices_are_shares(seed: int, share: float) -> None:
    random = np.random.default_rng(seed)
    good = random.uniform(size=(4, 3, 5)) < share
    good[0] = True
    first, total = sobol_indices(random.normal(size=good.shape), good)
    assert (first >= -1e-12).all() and (first <= total + 1e-9).all() and first.sum() <= 1 + 1e-9
    assert (total <= 1 + 1e-12).all()
