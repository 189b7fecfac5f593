"""What a loss feels: known quadratics, a parameter without influence, pairs that count as a sum in all worlds, in some, or in one."""

import numpy as np
import pytest

from hrcjax.tune.felt import ALIKE, LEAST_ROWS, STEP, feel

MATRIX = np.array([[2.0, 0.3, 0.0], [0.3, 1.0, -0.4], [0.0, -0.4, 3.0]])
WORLDS = np.array([[0.0, 0.0, 0.0], [0.4, -0.3, 0.2], [-0.2, 0.1, 0.5], [0.1, 0.6, -0.4]])


def quadratic(points):
    """One term, a quadratic about the point of each world."""
    away = points[:, None] - WORLDS
    each = 1 + 0.5 * np.einsum("kwi,ij,kwj->kw", away, MATRIX, away)
    return each.mean(axis=1), away.mean(axis=1) @ MATRIX, each[:, :, None]


def of_terms(terms, slopes):
    """A loss of one term in worlds from functions of points (point, parameter): (point, world) and (point, world, parameter)."""
    return lambda points: (terms(points).mean(axis=1), slopes(points).mean(axis=1), terms(points)[:, :, None])


@pytest.mark.parametrize("at_once", [1, 3, 8])
def test_gradient_curvature_and_rows_of_a_quadratic(at_once: int) -> None:
    sizes = []

    def counted(points):
        sizes.append(len(points))
        return quadratic(points)

    point = np.array([0.5, -1.0, 2.0])
    found = feel(counted, point, [2.0], at_once)
    assert set(sizes) == {at_once}
    loss = quadratic(point[None])[0][0]
    assert found.loss == pytest.approx(loss)
    np.testing.assert_allclose(found.gradient, MATRIX @ (point - WORLDS.mean(axis=0)), rtol=1e-12)
    np.testing.assert_allclose(found.curvature, MATRIX, atol=1e-12)
    np.testing.assert_allclose(found.rows, 2 * (point - WORLDS) @ MATRIX / loss, rtol=1e-10)
    assert found.felt.all() and found.alike() == [] == found.unknown() and not found.jumps.any()


def ratios(*each: float):
    """Terms (z0 + r z1 - 1)^2 + z2 with a ratio r of each world."""
    r = np.array(each)
    s = lambda z: z[:, :1] + r * z[:, 1:2] - 1  # noqa: E731
    slopes = lambda z: np.stack([2 * s(z), 2 * r * s(z), np.ones_like(s(z))], axis=-1)  # noqa: E731
    return of_terms(lambda z: s(z) ** 2 + z[:, 2:3], slopes)


def test_a_sum_in_all_worlds_is_not_told_apart_and_one_with_other_ratios_is() -> None:
    point = np.array([0.3, 0.2, 0.7])
    alike = feel(ratios(-2, -2, -2, -2), point, [1.0]).alike()
    assert [pair[:2] for pair in alike] == [(0, 1)] and alike[0][2] < -ALIKE
    assert feel(ratios(-2, 1, 0.5, 3), point, [1.0]).alike() == []


def test_parallel_columns_of_the_mean_second_derivative_do_not_matter() -> None:
    """Ratios 1 and 3 with the mean second derivative [[2, 4], [4, 10]] are told apart by two worlds, and so are 1, 2 and 3."""
    found = feel(ratios(1.0, 2.0, 3.0), np.array([0.3, 0.2, 0.7]), [1.0])
    columns = found.curvature[:2, :2] / np.linalg.norm(found.curvature[:2, :2], axis=0)
    assert columns[:, 0] @ columns[:, 1] > 0.98, "nearly alike in the mean"
    assert abs(found.cosines()[0, 1]) < 0.95 and found.alike() == []


def test_few_rows_do_not_tell() -> None:
    point = np.array([0.3, 0.2, 0.7])
    found = feel(ratios(-2, 1), point, [1.0])
    assert found.alike() == [] and found.unknown() == [(0, 1), (0, 2), (1, 2)] and LEAST_ROWS == 3
    twice = lambda points: (*ratios(-2, 1)(points)[:2], np.repeat(ratios(-2, 1)(points)[2], 2, axis=2))  # noqa: E731
    assert feel(twice, point, [0.5, 0.5]).unknown() == [], "two terms in two worlds"


def test_no_influence() -> None:
    made = ratios(-2, 1, 0.5)
    four = lambda z: (made(z[:, :3])[0], np.pad(made(z[:, :3])[1], ((0, 0), (0, 1))), made(z[:, :3])[2])  # noqa: E731
    found = feel(four, np.array([0.3, 0.2, 0.7, 0.2]), [1.0])
    assert found.felt.tolist() == [True, True, True, False]
    assert not found.cosines()[3].any() and found.unknown() == []


def test_an_optimum_is_felt_by_its_curvature() -> None:
    found = feel(
        lambda z: (quadratic(z)[0], (z - WORLDS.mean(axis=0)) @ MATRIX, quadratic(z)[2]), WORLDS.mean(axis=0), [1.0]
    )
    assert not found.gradient.any() and found.felt.all() and not found.jumps.any()


def test_a_jump_is_found_and_not_compared() -> None:
    """The first coordinate crosses a step of the loss that its slope does not see."""

    def stepped(points):
        loss, slope, each = quadratic(points)
        high = 3.0 * (points[:, 0] > 0.5 + STEP / 2)
        return loss + high, slope, each + high[:, None, None]

    found = feel(stepped, np.array([0.5, -1.0, 2.0]), [1.0])
    assert found.jumps.tolist() == [True, False, False]
    assert np.isnan(found.cosines()[0]).all() and found.unknown() == [] == found.alike()


def test_worlds_that_are_alike_do_not_hide_the_curvature() -> None:
    """In one world three times over, all columns are parallel; what the second derivative knows apart is not called alike."""
    there = np.array([0.5, -1.0, 2.0])
    terms = lambda z: np.tile(1 + ((z + there) ** 2).sum(axis=1, keepdims=True), (1, 3))  # noqa: E731
    slopes = lambda z: np.tile(2 * (z + there)[:, None], (1, 3, 1))  # noqa: E731
    found = feel(of_terms(terms, slopes), np.zeros(3), [1.0])
    np.testing.assert_allclose(np.abs(found.cosines()), 1.0, atol=1e-9)
    assert found.alike() == []


def test_what_is_not_finite_is_not_felt() -> None:
    def gradients(points):
        terms = np.tile(2 + points[:, :1] ** 2, (1, 3))
        return terms[:, 0], np.stack([2 * points[:, 0], np.nan * points[:, 1]], axis=1), terms[:, :, None]

    found = feel(gradients, np.ones(2), [1.0])
    assert found.felt.tolist() == [True, False] and found.alike() == []


def test_a_world_that_is_not_finite_is_left_out() -> None:
    made = ratios(-2, -2, -2, -2)

    def gradients(points):
        each = made(points)[2].copy()
        each[:, 1] = np.nan
        return *made(points)[:2], each

    assert [pair[:2] for pair in feel(gradients, np.array([0.3, 0.2, 0.7]), [1.0]).alike()] == [(0, 1)]
