"""Noise beside a surface: a point that was measured once, is seen through ever since, and has a surface about it, fades."""

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest

from hrcjax.map import MapParams, View, empty_map
from hrcjax.sense import d435i

PARAMS = MapParams()
ONCE, OFTEN, BESIDE_ONCE, BESIDE_OFTEN = range(4)
POINTS = np.array(
    [[0.1125, 0.1125, 0.0575], [-0.1125, 0.1125, 0.0575], [0.1125, 0.1125, 0.0375], [-0.1125, 0.1125, 0.0375]]
)
"""Two points, and one 2 cm under each, on a surface."""
EYE = 1.0
"""Height of the camera, which looks straight down [m]."""


@pytest.fixture(scope="module")
def take(points_program, layout):
    """(which points each frame measures, as one pixel would) -> the maps after each."""
    camera = d435i(jnp.asarray([0.0, 0.0, EYE], jnp.float32), jnp.asarray([0.0, 1e-3, 0.0], jnp.float32), 1)
    deviation = float(PARAMS.pixel_noise) * (EYE - POINTS[:, 2]) ** 2
    past = jnp.full((120, 160), 1.3, jnp.float32)  # every pixel sees the floor far below
    points, variance = (jnp.asarray(v, jnp.float32) for v in (POINTS, deviation**2))
    view = View(points, jnp.zeros(4, bool), variance, past)

    def run(measured):
        state, after = empty_map(layout), []
        for which in measured:
            mask = jnp.asarray(np.isin(np.arange(4), which))
            state, report = points_program(state, camera, dataclasses.replace(view, mask=mask))
            after.append((state, report))
        return after

    return run


def holds(state, which: int) -> bool:
    rows = np.asarray(state.levels[0].rows)
    points = np.moveaxis(rows[:, :3], 1, 2)[rows[:, 3] > 0]
    return bool((np.linalg.norm(points - POINTS[which], axis=1) < 1e-3).any())


def test_it_goes_when_too_little_is_left_of_what_was_known(take) -> None:
    """Of one pixel's information 0.8^n are left after n frames, of three pixels' 3 x 0.8^n: less than 0.6 from the third
    and from the eighth frame on."""
    surface = [BESIDE_ONCE, BESIDE_OFTEN]
    after = take([[OFTEN], [OFTEN], [ONCE, OFTEN], *[surface] * 9])[2:]
    kept = {which: [holds(state, which) for state, _ in after] for which in (ONCE, OFTEN)}
    assert kept[ONCE] == [True] * 3 + [False] * 7
    assert kept[OFTEN] == [True] * 8 + [False] * 2
    assert all(holds(after[-1][0], which) for which in surface)
    assert [int(report.dynamic) for _, report in after] == [0] * 10, "what has a surface about it has not moved away"
    assert [int(report.removed) for _, report in after] == [0, 0, 0, 1, 0, 0, 0, 0, 1, 0]


def test_it_comes_back_to_full_when_it_is_measured_again(take) -> None:
    surface = [BESIDE_ONCE, BESIDE_OFTEN]
    after = take([[ONCE], surface, surface, [ONCE, *surface], surface, surface, surface])
    assert all(holds(state, ONCE) for state, _ in after), "1.64 pixels' information: 0.84 are left after three frames"


def test_alone_it_goes_by_patience(take) -> None:
    """Nothing about: it is dynamic, and goes with the first frame that sees through it, whatever was known."""
    after = take([[OFTEN], [OFTEN], [OFTEN], [], []])
    assert [holds(state, OFTEN) for state, _ in after] == [True, True, True, False, False]
    assert [int(report.dynamic) for _, report in after] == [0, 0, 0, 1, 0]
