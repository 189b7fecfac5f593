"""A user's losses on shapes: what is accepted, and the line for what is not."""

import jax.numpy as jnp
import numpy as np
import pytest

from hrcjax.lab.errors import UsageError
from hrcjax.tune.checked import LONGEST, check_losses
from hrcjax.tune.declared import LOSSES, Loss

RAN = []


def play(params, world):
    """In place of an episode."""
    RAN.append(world)
    return {"tool": jnp.outer(params["gain"] * jnp.ones(4), world)}


def check(of, name: str = "mine:loss") -> None:
    check_losses([Loss(name, "1", "", of)], {"gain": 2.0}, "a cell", jnp.ones(3), play)


def test_a_real_scalar_of_jax_operations_is_accepted() -> None:
    check(lambda p, c, w, e: jnp.sum(e["tool"]) * p["gain"])
    check(lambda p, c, w, e: 0.5)
    check(lambda p, c, w, e: jnp.float32(len(c)))


@pytest.mark.parametrize(
    ("of", "message"),
    [
        (lambda p, c, w, e: e["tool"], r"returns an array of shape \(4, 3\)"),
        (lambda p, c, w, e: jnp.sum(e["tool"])[None], r"returns an array of shape \(1,\)"),
        (lambda p, c, w, e: jnp.sum(e["tool"] > 0), "returns a number of type int"),
        (lambda p, c, w, e: jnp.sum(e["tool"]).astype(complex), "returns a number of type complex"),
        (lambda p, c, w, e: None, "returns nothing"),
        (lambda p, c, w, e: (jnp.sum(w), jnp.sum(w)), "returns a tuple"),
        (lambda p, c, w, e: e["tol"], "KeyError: 'tol'"),
        (lambda p: 0.0, "TypeError: "),
        (lambda p, c, w, e: float(np.sum(e["tool"])), "Error: "),
        (lambda p, c, w, e: "a text", "Error: "),
    ],
)
def test_one_line_for_what_is_not(of, message: str) -> None:
    with pytest.raises(UsageError, match=f"^--loss mine:loss: .*{message}.*accepted is a function") as caught:
        check(of)
    assert "\n" not in str(caught.value) and len(str(caught.value)) < LONGEST + 200


def test_declared_losses_cost_nothing() -> None:
    RAN.clear()
    check_losses([LOSSES["sound"]], {"gain": 2.0}, "a cell", jnp.ones(3), play)
    assert RAN == []
