"""The lazy roadmap in a plane with a wall."""

import numpy as np

from hrcjax.plan.roadmap import roadmap_lines, shortcut, subdivided

START, GOAL = np.array([-1.0, 0.0]), np.array([1.0, 0.0])


def free(q):
    """A wall between them with gaps above and below."""
    return ~((np.abs(q[:, 0]) < 0.1) & (np.abs(q[:, 1]) < 0.8))


def test_lines_are_free_and_go_round_both_ways():
    wide = np.full(2, 3.0)
    lines = roadmap_lines(START, GOAL, -wide, wide, free, np.random.default_rng(0), samples=400)
    assert len(lines) == 4
    for line in lines:
        np.testing.assert_array_equal(line[[0, -1]], [START, GOAL])
        assert free(subdivided(line, 0.005)).all()
    lengths = [np.linalg.norm(np.diff(line, axis=0), axis=1).sum() for line in lines]
    assert min(lengths) < 1.1 * 2 * (np.hypot(0.9, 0.8) + 0.1)  # the shortest way has corners at (-+ .1, .8)
    sides = {np.sign(line[np.argmax(np.abs(line[:, 1])), 1]) for line in lines}
    assert sides == {-1.0, 1.0}


def test_nothing_is_found_through_a_closed_wall():
    wide = np.full(2, 3.0)
    closed = roadmap_lines(
        START, GOAL, -wide, wide, lambda q: np.abs(q[:, 0]) > 0.1, np.random.default_rng(0), samples=200
    )
    assert closed == []


def test_cuts_shorten():
    line = np.array([[-1.0, 0], [-1, 2], [1, 2], [1, 0]])
    short = shortcut(line, free, np.random.default_rng(1), tries=80)
    length, before = (np.linalg.norm(np.diff(x, axis=0), axis=1).sum() for x in (short, line))
    assert length < 0.8 * before and free(subdivided(short, 0.005)).all()
