"""What a loss feels: known quadratics, a parameter without influence, a pair that only counts as a sum."""

import numpy as np
import pytest

from hrcjax.tune.felt import ALIKE, feel

MATRIX = np.array([[2.0, 0.3, 0.0], [0.3, 1.0, -0.4], [0.0, -0.4, 3.0]])


def quadratic(points):
    return 1 + 0.5 * np.einsum("ki,ij,kj->k", points, MATRIX, points), points @ MATRIX


@pytest.mark.parametrize("at_once", [1, 3, 8])
def test_gradient_and_curvature_of_a_quadratic(at_once: int) -> None:
    sizes = []

    def counted(points):
        sizes.append(len(points))
        return quadratic(points)

    point = np.array([0.5, -1.0, 2.0])
    found = feel(counted, point, at_once)
    assert set(sizes) == {at_once}
    assert found.loss == pytest.approx(quadratic(point[None])[0][0])
    np.testing.assert_allclose(found.gradient, MATRIX @ point, rtol=1e-12)
    np.testing.assert_allclose(found.curvature, MATRIX, atol=1e-12)
    assert found.felt.all() and found.alike() == []


def test_no_influence_and_a_sum() -> None:
    """The loss 1 + (a - 2 b)^2 + c^2 feels a and b as one, c alone, and not d."""

    def gradients(points):
        a, b, c, _ = points.T
        s = a - 2 * b
        return 1 + s**2 + c**2, np.stack([2 * s, -4 * s, 2 * c, 0 * c], axis=1)

    found = feel(gradients, np.array([0.3, 0.1, 0.7, 0.2]))
    assert found.felt.tolist() == [True, True, True, False]
    assert [pair[:2] for pair in found.alike()] == [(0, 1)] and found.alike()[0][2] < -ALIKE


def test_an_optimum_is_felt_by_its_curvature() -> None:
    found = feel(quadratic, np.zeros(3))
    assert not found.gradient.any() and found.felt.all()


def test_what_is_not_finite_is_not_felt() -> None:
    def gradients(points):
        return np.full(len(points), 2.0), np.stack([points[:, 0], np.nan * points[:, 1]], axis=1)

    found = feel(gradients, np.ones(2))
    assert found.felt.tolist() == [True, False] and found.alike() == []
