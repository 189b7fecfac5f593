"""Reading a person at any time."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from hrcjax.world.person import RADII, REGIONS, Person, person_at


def _person(dtype, present=(True, True, False, False)):
    a = jnp.asarray(np.arange(4)[:, None, None] * np.ones((1, 2, 3)), dtype)
    return Person(
        a=a,
        b=2 * a,
        radius=jnp.asarray([0.1, 0.2], dtype),
        rate=jnp.asarray(2.0, dtype),
        present=jnp.asarray(present),
        regions=("hand", "head"),
    )


@pytest.mark.parametrize(
    ("t", "place", "there"),
    [(0.0, 0, True), (0.25, 0.5, True), (0.5, 1, True), (0.75, 1.5, True), (1.0, 2, False), (1.25, 2.5, False),
     (9.0, 3, False), (-1.0, 0, True)],
)  # fmt: skip
def test_between_and_beyond_frames(t, place, there, dtype):
    capsules = jax.jit(person_at)(_person(dtype), t)
    assert capsules.a.dtype == dtype and capsules.radius.dtype == dtype
    np.testing.assert_allclose(capsules.a, place, atol=1e-6)
    np.testing.assert_allclose(capsules.b, 2 * place, atol=1e-6)
    np.testing.assert_allclose(capsules.radius, [0.1, 0.2] if there else [-1, -1])


def test_absent_only_where_both_neighbours_are():
    person = _person(jnp.float64, (False, True, False, False))
    there = [bool((person_at(person, t).radius > 0).all()) for t in (0.0, 0.1, 0.5, 0.9, 1.0, 1.2)]
    assert there == [False, True, True, True, False, False]
    left = _person(jnp.float64, (False, False, True, False))  # gone in the last frame
    assert [bool((person_at(left, t).radius > 0).all()) for t in (1.0, 1.4, 1.5, 9.0)] == [True, True, False, False]


def test_speed_and_one_frame():
    person = _person(jnp.float64)
    speed = jax.jacfwd(lambda t: person_at(person, t).a)(0.6)
    np.testing.assert_allclose(speed, 2.0)
    one = Person(person.a[:1], person.b[:1], person.radius, person.rate, person.present[:1], person.regions)
    np.testing.assert_allclose(person_at(one, 5.0).a, person.a[0])
    assert (np.asarray(person_at(one, 5.0).radius) > 0).all()


def test_radii_are_those_of_the_literature():
    assert [RADII[k] for k in ("chest", "head", "upper arm", "forearm", "hand")] == [0.22, 0.15, 0.10, 0.066, 0.103]
    assert set(REGIONS) == set(RADII) and len(REGIONS) == 14
