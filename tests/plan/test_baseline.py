import jax.numpy as jnp
import numpy as np
from plan_scenes import GOAL, START, scene

from hrcjax.plan import GradientDescentParams, gradient_descent_path


def centimetre_path(start, goal, centre, radius, steps):
    """The paper's gradient descent in its own centimetres: K_att 1/150, K_rep 900, d0 4."""
    q, out = np.array(start, float), [np.array(start, float)]
    for _ in range(steps):
        away = q - centre
        rho = np.linalg.norm(away) - radius
        move = -(q - goal) / 150
        if rho < 4:
            move = move + 900 * (1 / rho - 1 / 4) / rho**2 * away / np.linalg.norm(away)
        size = np.linalg.norm(move)
        q = q + move * min(1.0, 5 / size)
        out.append(q)
    return np.array(out)


def test_agrees_with_the_paper_in_centimetres():
    centre = np.array([40.0, 45.0, 10.0])
    s = scene(centers=centre[None] / 100, radius=0.03)
    path = gradient_descent_path(GradientDescentParams(), s.start, s.goal, s.distances, s.radius, 120)
    expected = centimetre_path(START * 100, GOAL * 100, centre, 3.0, 120) / 100
    assert float(jnp.min(jnp.linalg.norm(path.waypoints - centre / 100, axis=1))) < 0.07  # it does meet the obstacle
    np.testing.assert_allclose(path.waypoints[:60], expected[:60], atol=1e-9)


def test_free_descent_takes_as_long_as_its_gain_says():
    s = scene(centers=np.full((1, 3), 9.0))
    path = gradient_descent_path(GradientDescentParams(), s.start, s.goal, s.distances, s.radius, 700)
    expected = np.ceil(np.log(np.linalg.norm(START - GOAL) / 0.01) / -np.log1p(-1 / 150))
    assert bool(path.reached) and int(path.arrival) == int(expected)
