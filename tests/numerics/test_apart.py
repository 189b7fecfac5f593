"""A border changes no value and no derivative, in any transformation, with the options that keep it and without."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from hrcjax.numerics import computed, unrolled_options

X = jnp.asarray([0.3, -1.2, 0.8])


def f(x, border=computed):
    a, b = border((jnp.sin(x), x[0] * x))
    return jnp.sum(border(a * b)[:, None] * x[None, :] ** 2)


def plain(x):
    return f(x, lambda tree: tree)


@pytest.mark.parametrize("options", [{}, unrolled_options()], ids=["plain", "kept"])
def test_same_value_and_derivatives(options: dict) -> None:
    for of in (
        lambda g: g,
        jax.grad,
        lambda g: jax.jacfwd(jax.grad(g)),
        lambda g: lambda x: jax.vmap(g)(jnp.stack([x, 2 * x])),
    ):
        one, other = (jax.jit(of(g), compiler_options=options)(X) for g in (f, plain))
        np.testing.assert_allclose(one, other, rtol=1e-12)


def test_the_border_is_kept_by_the_options() -> None:
    if jax.default_backend() != "cpu":
        pytest.skip("options of a CPU")
    lowered = jax.jit(f).lower(X)
    assert "opt-barrier" in lowered.compile(compiler_options=unrolled_options()).as_text()
