"""Commands by votes: when each is given, and what never gives one."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hrcjax.hand import (
    CLOSED,
    GO,
    HOME,
    NO_COMMAND,
    NONE,
    OPEN,
    POINT,
    POINTING,
    STOP,
    CommandParams,
    initial_commands,
    update_commands,
)

LOST = -1
PARAMS = CommandParams()


@jax.jit
def _scan(probability, seen, dt, stopped):
    def frame(state, now):
        state, command = update_commands(PARAMS, state, *now)
        return state, (command, state.stopped)

    begin = initial_commands(jnp.dtype("float32"))
    begin = jax.tree.map(lambda a: a, begin)
    begin = eqx.tree_at(lambda s: s.stopped, begin, stopped)
    return jax.lax.scan(frame, begin, (probability, seen, dt))[1]


LENGTH = 240


def told(first, second=None, dt=1 / 30, certain=0.97, stopped=False):
    """Commands and standing, of gestures of one or two hands, frame by frame."""
    hands = [list(first), list(second) if second is not None else [LOST] * len(first)]
    n = len(first)
    hands = np.array([one + [LOST] * (LENGTH - n) for one in hands]).T
    probability = np.full((LENGTH, 2, 4), (1 - certain) / 3, np.float32)
    for g in range(4):
        probability[..., g][hands == g] = certain
    probability[hands == LOST] = np.nan
    steps = np.full(LENGTH, 1 / 30, np.float32)
    steps[:n] = dt
    command, stands = _scan(
        jnp.asarray(probability), jnp.asarray(hands != LOST), jnp.asarray(steps), jnp.asarray(stopped)
    )
    return np.asarray(command)[:n], np.asarray(stands)[:n]


def test_an_open_hand_stops_within_two_frames_and_once() -> None:
    command, stands = told([LOST] * 3 + [OPEN] * 10)
    assert np.flatnonzero(command).tolist() == [4] and command[4] == STOP
    assert not stands[:4].any() and stands[4:].all()


@pytest.mark.parametrize("missed", [1, 2])
def test_an_open_hand_that_is_seen_now_and_then_stops_at_its_second_sight_and_once(missed) -> None:
    command, stands = told(([OPEN] + [LOST] * missed) * 10)
    assert np.flatnonzero(command).tolist() == [1 + missed] and command[1 + missed] == STOP
    assert stands[1 + missed :].all() and not stands[: 1 + missed].any()


def test_single_sights_of_an_open_hand_far_apart_do_not_stop() -> None:
    assert not told(([OPEN] + [LOST] * 3) * 10)[0].any()
    command, _ = told([OPEN] * 3 + [LOST] * 3 + [OPEN] * 3)
    assert command.tolist() == [0, STOP, 0, 0, 0, 0, 0, STOP, 0], "after its end a stop may be given again"


def test_a_closed_hand_may_not_be_missed() -> None:
    """Only a stop bridges frames without a vote; beside an open hand that flickers nothing starts."""
    assert not told([CLOSED] * 9 + ([LOST] + [CLOSED] * 9) * 5, stopped=True)[0].any()
    command, stands = told([CLOSED] * 60, [OPEN, LOST, LOST] * 20, stopped=True)
    assert GO not in command and stands.all()


@pytest.mark.parametrize("rate", [15, 30, 60])
def test_a_closed_hand_goes_on_after_half_a_second_whatever_the_rate(rate) -> None:
    command, stands = told([CLOSED] * rate + [CLOSED] * rate, dt=1 / rate, stopped=True)
    given = np.flatnonzero(command)
    assert len(given) == 1 and command[given[0]] == GO
    assert 0.5 - 1e-4 <= given[0] / rate <= 0.5 + 1.01 / rate or given[0] == 9  # at least ten votes
    assert stands[: given[0]].all() and not stands[given[0] :].any()


def test_pointing_and_two_open_hands_choose_and_do_not_start() -> None:
    command, stands = told([POINTING] * 40, stopped=True)
    assert command[command > 0].tolist() == [POINT] and stands.all()
    command, stands = told([OPEN] * 60, [OPEN] * 60)
    assert command[command > 0].tolist() == [STOP, HOME] and stands[1:].all()
    assert np.flatnonzero(command == HOME)[0] >= 30


def test_an_open_hand_outranks_a_closed_one() -> None:
    command, stands = told([CLOSED] * 60, [OPEN] * 60, stopped=True)
    assert GO not in command and stands.all()


def test_after_a_stop_a_go_needs_its_whole_time_again() -> None:
    command, stands = told([CLOSED] * 20 + [OPEN] * 2 + [CLOSED] * 30)
    assert np.flatnonzero(command).tolist() == [15, 21, 37] and command[[15, 21, 37]].tolist() == [GO, STOP, GO]
    assert stands[21:37].all() and not stands[37:].any()


def test_flicker_of_two_frames_in_three_is_too_little() -> None:
    command, _ = told([CLOSED, CLOSED, LOST] * 40, stopped=True)
    assert not command.any()


def test_an_uncertain_hand_commands_nothing_but_a_stop() -> None:
    assert not told([CLOSED] * 60, certain=0.85, stopped=True)[0].any()
    assert not told([POINTING] * 60, certain=0.85)[0].any()
    assert told([OPEN] * 3, certain=0.55)[0].tolist() == [0, STOP, 0]


def test_frames_far_apart_or_without_time_count_for_nothing() -> None:
    for dt in (0.25, 0.0, -1.0, np.nan, np.inf):
        assert not told([CLOSED] * 60, dt=dt, stopped=True)[0].any()
    jump = np.full(40, 1 / 30)
    jump[14] = 0.5
    command, _ = told([CLOSED] * 40, dt=jump, stopped=True)
    assert np.flatnonzero(command == GO)[0] == 14 + 15


hands = st.lists(
    st.tuples(st.sampled_from([OPEN, CLOSED, POINTING, NONE, LOST]), st.integers(1, 25)), min_size=1, max_size=9
).map(lambda runs: [g for g, n in runs for _ in range(n)])


@settings(max_examples=150, deadline=None)
@given(first=hands, second=hands)
def test_no_motion_starts_but_by_half_a_second_of_a_closed_hand(first, second) -> None:
    """Whatever two hands do, a go comes while one is closed, after 15 intervals of it and none open; a loss starts nothing."""
    n = min(len(first), len(second))
    first, second = np.array(first[:n]), np.array(second[:n])
    command, stands = told(first, second, stopped=True)
    closed = ((first == CLOSED) | (second == CLOSED)) & (first != OPEN) & (second != OPEN)
    for k in np.flatnonzero(command == GO):
        assert closed[k - 9 : k + 1].all() and closed[: k + 1].sum() >= 16
        assert stands[k] == False and stands[k - 1] in (True, False)  # noqa: E712  # a bool of NumPy
    moves = np.flatnonzero(~stands[1:] & stands[:-1]) + 1
    assert (command[moves] == GO).all()
    nobody = (first == LOST) & (second == LOST)
    assert (command[nobody] == NO_COMMAND).all()


@settings(max_examples=60, deadline=None)
@given(first=hands, second=hands)
def test_two_frames_of_an_open_hand_always_stop(first, second) -> None:
    n = min(len(first), len(second))
    first, second = np.array(first[:n]), np.array(second[:n])
    _, stands = told(first, second)
    opened = (first == OPEN) | (second == OPEN)
    assert stands[1:][opened[1:] & opened[:-1]].all()


def test_what_is_not_a_number_is_no_vote() -> None:
    state = initial_commands(jnp.dtype("float32"), True)
    for _ in range(40):
        nothing = jnp.full((2, 4), jnp.nan, jnp.float32)
        state, command = update_commands(PARAMS, state, nothing, jnp.ones(2, bool), jnp.float32(1 / 30))
        assert int(command) == NO_COMMAND and bool(state.stopped)


@pytest.mark.parametrize("dt", [0.25, 0.0, float("nan")])
def test_a_slow_stream_stops_but_lets_nothing_start(dt) -> None:
    """Over gaps votes for a stop add up; those for motion do not."""
    command, stands = told([OPEN] * 6, dt=dt)
    assert command[1] == STOP and stands[1:].all()
    command, stands = told([CLOSED] * 40, dt=dt, stopped=True)
    assert (command == NO_COMMAND).all() and stands.all()
