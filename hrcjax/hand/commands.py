"""From gestures, frame by frame, to commands: votes with a hold time and hysteresis. A state that a scan can carry."""

import equinox as eqx
import jax.numpy as jnp

from hrcjax.hand.landmarks import CLOSED, OPEN, POINTING
from hrcjax.typing import Array, Bool, Float, Int, Scalar

NO_COMMAND, STOP, GO, POINT, HOME = range(5)
COMMANDS = ("none", "stop", "go", "point", "home")
"""Names of the commands."""
LONGEST_FRAME = 0.1
"""Longest time that one frame can count as [s]."""


class CommandRule(eqx.Module):
    """When a gesture is a command."""

    certainty: float = 0.5
    """Least probability of the gesture for a vote [1]."""
    hold: float = 0.5
    """Time for which it must be shown [s]."""
    frames: int = 2
    """Votes in a row that it needs at least."""
    misses: int = 0
    """Frames in a row without a vote that do not end a row."""
    loss: float = 2.0
    """Time that a frame without vote takes away, over the duration of the frame [1]."""
    release: float = 0.5
    """A command that was given is over, and may be given again, below this share of its hold time [1]."""


class CommandParams(eqx.Module):
    """The table of commands."""

    stop: CommandRule = CommandRule(certainty=0.5, hold=0.0, frames=2, misses=2)
    """One open hand: stop, also if its detector sees it only now and then."""
    go: CommandRule = CommandRule(certainty=0.9, hold=0.5, frames=10)
    """One closed hand and none open: go on. The one command after which the arm moves."""
    point: CommandRule = CommandRule(certainty=0.9, hold=0.5, frames=10)
    """One pointing hand: a start or goal here."""
    home: CommandRule = CommandRule(certainty=0.8, hold=1.0, frames=10)
    """Two open hands: home is the goal. They stop the arm as well; it goes there when a closed hand says so."""
    longest_gap: float = 0.2
    """Gap between two frames after which nothing counts that was shown before [s]."""

    def rules(self) -> tuple[CommandRule, ...]:
        """Those of stop, go, point and home, in this order."""
        return self.stop, self.go, self.point, self.home


class CommandState(eqx.Module):
    """Memory from frame to frame; of stop, go, point and home."""

    held: Float[Array, "command"]
    """Time for which each was shown, less what was lost [s]."""
    row: Int[Array, "command"]
    """Votes in a row."""
    missed: Int[Array, "command"]
    """Frames since the last one."""
    given: Bool[Array, "command"]
    """Whether it was given and is not over."""
    stopped: Bool[Array, ""]
    """Whether the arm must stand: from a stop until a go."""


def initial_commands(dtype: jnp.dtype, stopped: bool = False) -> CommandState:
    """Nothing shown yet."""
    none = jnp.zeros(4, jnp.int32)
    return CommandState(jnp.zeros(4, dtype), none, none, jnp.zeros(4, bool), jnp.asarray(stopped))


def frame_votes(
    params: CommandParams, probability: Float[Array, "hand gesture"], seen: Bool[Array, "hand"]
) -> Bool[Array, "command"]:
    """What the hands of one frame vote for: stop, go, point, home. An open hand silences all but home.

    What is not a number votes for nothing.
    """

    def shows(gesture: int, rule: CommandRule) -> Bool[Array, "hand"]:
        return seen & (probability[:, gesture] >= rule.certainty)

    stop = jnp.any(shows(OPEN, params.stop))
    go = jnp.any(shows(CLOSED, params.go)) & ~stop
    point = jnp.any(shows(POINTING, params.point)) & ~stop
    home = jnp.sum(shows(OPEN, params.home)) >= 2
    return jnp.stack([stop, go & ~point, point, home])


def update_commands(
    params: CommandParams,
    state: CommandState,
    probability: Float[Array, "hand gesture"],
    seen: Bool[Array, "hand"],
    dt: Scalar,
) -> tuple[CommandState, Int[Array, ""]]:
    """One frame: the memory after it, and the command given in it, `NO_COMMAND` in most.

    A command is given in a frame that votes for it, when it has been shown for its hold time and in its number of frames in a
    row; few frames without a vote do not end the row of a stop. So the loss of a hand, or of the camera, gives none; it does not end a stop either. A stop has the rank before all.

    Args:
        probability: of open, closed, pointing and none, of each hand.
        seen: whether there is such a hand.
        dt: time since the frame before [s].
    """
    vote = frame_votes(params, probability, seen)
    rules = params.rules()
    dtype, row_type = state.held.dtype, state.row.dtype
    hold, loss, release = (jnp.asarray([getattr(r, k) for r in rules], dtype) for k in ("hold", "loss", "release"))
    need, misses = (jnp.asarray([getattr(r, k) for r in rules], row_type) for k in ("frames", "misses"))
    known = (dt > 0) & (dt <= params.longest_gap)
    step = jnp.where(known, jnp.clip(dt, 0.0, LONGEST_FRAME), 0.0).astype(dtype)
    # over a gap what counts towards motion begins anew; what counts towards a stop stays
    stays = known | jnp.asarray([True, False, False, False])
    held, row = jnp.where(known, state.held, 0.0), jnp.where(stays, state.row, 0)
    # only the time between two votes counts: what a hand did before it was first seen is not known
    held = jnp.where(
        vote, jnp.minimum(held + jnp.where(row > 0, step, 0.0), hold), jnp.maximum(held - loss * step, 0.0)
    )
    missed = jnp.where(vote, 0, jnp.minimum(state.missed, misses) + 1)
    row = jnp.where(missed > misses, 0, row + vote.astype(row_type))

    full = vote & (held >= hold) & (row >= need)
    stop, go, point, home = full & ~state.given
    given = full | (state.given & jnp.where(hold > 0, held >= release * hold, row > 0))
    stopped = full[0] | (state.stopped & ~go)
    begins_anew = jnp.asarray([False, True, True, False]) & full[0]  # a stop takes back what was shown before it
    held, row, given = jnp.where(begins_anew, 0.0, held), jnp.where(begins_anew, 0, row), given & ~begins_anew
    command = jnp.where(home, HOME, jnp.where(point, POINT, jnp.where(go, GO, NO_COMMAND)))
    command = jnp.where(stop, STOP, command).astype(jnp.int32)
    return CommandState(held, row, missed, given, stopped), command
