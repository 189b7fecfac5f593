"""Health of a camera, judged by each image and its stamps alone: is it new, complete, sharp, in time?

What is usual for a camera is learnt while the cell is empty; the robot may move. Images must have a sensor's noise: exact
ones of a cell at rest repeat. A person whom the camera does not measure stays unnoticed.
"""

import equinox as eqx
import jax.numpy as jnp

from hrcjax.bits import pack, words
from hrcjax.sense.look import look, same_share
from hrcjax.typing import Array, Bool, Float, Int, Scalar

IDENTICAL = 1
BLOCKED_VIEW = 2
BLURRED_VIEW = 4
PART_EMPTY = 8
LATE_ARRIVAL = 16
SKEWED_STAMP = 32
NO_IMAGE = 64

HEALTH_REASONS = {
    IDENTICAL: "the last image again",
    BLOCKED_VIEW: "view blocked",
    BLURRED_VIEW: "edges blurred",
    PART_EMPTY: "a part of the image empty",
    LATE_ARRIVAL: "arrived late",
    SKEWED_STAMP: "time stamp ahead, not advancing, or off the usual delay",
    NO_IMAGE: "no image",
}
"""What is wrong with a camera: bit -> words."""


class HealthParams(eqx.Module):
    """Thresholds. Where no source is named they are our choice."""

    identical_share: Scalar = 0.95
    """Share of measured pixels exactly as before from which an image is the last one again [1]. Two readings of deviation
    s, rounded to q = 1 mm, are equal with probability near q / (2 s sqrt(pi)): of a still D435i 0.02 at 2 m, 0.07 at 1 m,
    0.27 at 0.5 m, and at most 0.64 at its nearest depth of 0.28 m. Over thousands of pixels that varies by less than 0.01."""
    least_share: Scalar = 0.05
    """An image with less measured has no depth, whatever was learnt; as for frames of the map [1]."""
    nearest: Scalar = 0.28
    """Nearer is not measured: the camera's least depth; what reads nearer is something on the lens [m]."""
    blocked_share: Scalar = 0.3
    """The view is blocked if less than this share of what was measured of the empty cell is measured [1]. People and robot
    are measured too; their stereo shadows and edges took less than 0.1 in our sequences."""
    part_share: Scalar = 0.25
    """The same for each quadrant. A person of whom nothing is measured leaves about half of it [1]."""
    least_part: Scalar = 0.1
    """A quadrant of which less is measured in the empty cell is not judged [1]."""
    edge: Scalar = 0.08
    """Change of inverse depth within `look.RUN` pixels that counts as an edge: 8 cm at 1 m, 32 cm at 2 m [1/m]. The noise of
    inverse depth is that of disparity, the same at any depth: 0.004 1/m, of which 5 pixels hardly ever span more than 0.025. Inverse
    depth is linear on a plane; table and floor change by less than 0.03."""
    slope: Scalar = 0.15
    """And it must be more than this share of the larger depth: 4 pixels of 1/96 on a surface at 75 degrees to the image. From
    0.5 m on near, slanting surfaces would be edges that look smeared [1]."""
    least_edges: Scalar = 100.0
    """Runs of pixels across edges below which sharpness is not judged [1]: some 30 places of an edge."""
    blurred_share: Scalar = 0.65
    """An image is blurred if its sharpness is below this share of the learnt one [1]: between a sharp edge, 1, and one
    smeared over more than a run, 0.25. Images of a real depth camera are at 0.85 to 0.91, smeared over 9 pixels at 0.32 to
    0.38."""
    late: Scalar = 0.15
    """An image that arrives later than this after its stamp is late: the safety monitor's data would be too old by then [s]."""
    ahead: Scalar = 0.005
    """A stamp this much after the arrival is ahead of it: accuracy to which camera and host clocks are joined [s]."""
    delay_change: Scalar = 0.05
    """A delay this far from the learnt one is the clock's fault, or the way's [s]; usual jitter is below one period, 33 ms."""
    silence: Scalar = 1.5
    """Periods without image from which one is missing [1]."""


class HealthState(eqx.Module):
    """A camera's last image, and what is usual for it."""

    last: Float[Array, "height width"]
    """The last image that arrived, healthy or not; 0: none yet [m]."""
    stamp: Float[Array, ""]
    """The last stamp that was believed; minus infinity: none yet [s]."""
    arrived: Float[Array, ""]
    """When the latest arrived, on the host's clock; minus infinity: none yet [s]."""
    measured: Float[Array, "2 2"]
    """Mean share of each quadrant that is measured [1]."""
    sharpness: Float[Array, ""]
    """Mean sharpness, see `Look` [1]."""
    edges: Float[Array, ""]
    """Number of runs of pixels that it is the mean of [1]."""
    delay: Float[Array, ""]
    """Mean time between stamp and arrival [s]."""
    learnt: Float[Array, ""]
    """Number of images that the means are of [1]."""


def describe_health(bits: int) -> str:
    """What is wrong with a camera in words; "none" for 0."""
    return words(HEALTH_REASONS, bits)


def initial_health(height: int, width: int, dtype: jnp.dtype | type = jnp.float32) -> HealthState:
    """No image yet, nothing learnt."""
    zero, never = jnp.zeros((), dtype), jnp.asarray(-jnp.inf, dtype)
    return HealthState(
        jnp.zeros((height, width), dtype), never, never, jnp.zeros((2, 2), dtype), zero, zero, zero, zero
    )


def judge_image(
    params: HealthParams,
    state: HealthState,
    depth: Float[Array, "height width"],
    stamp: Float[Array, ""],
    arrived: Float[Array, ""],
    learning: Bool[Array, ""] | bool,
) -> tuple[HealthState, Int[Array, ""]]:
    """Judges one image that arrived. Call it for each one, in the order of arrival.

    Until something is learnt an image is only refused for having no depth, repeating the last one, its stamp or its age.
    An image that is refused is not learnt.

    Args:
        params: thresholds.
        state: of this camera.
        depth: 0 or not finite: no measurement [m].
        stamp: when the camera says that it was exposed, since a moment not long ago [s].
        arrived: when it arrived, on the host's clock, since the same moment [s].
        learning: True while the cell is known to be empty and the camera to work.

    Returns:
        the state, and bits of what is wrong (`describe_health`); 0: nothing.
    """
    seen = look(depth, params.nearest, params.edge, params.slope)
    finite = jnp.isfinite(stamp) & jnp.isfinite(arrived)
    delay = jnp.where(finite, arrived - stamp, 0)
    usual = jnp.mean(state.measured)
    bare = seen.measured < params.part_share * state.measured
    judged = state.measured >= params.least_part
    unusual = (state.learnt > 0) & ~jnp.asarray(learning) & (jnp.abs(delay - state.delay) > params.delay_change)
    blocked = jnp.mean(seen.measured) < jnp.maximum(params.least_share, params.blocked_share * usual)
    skewed = ~finite | (stamp <= state.stamp) | (delay < -params.ahead) | unusual

    reasons = pack(
        {
            IDENTICAL: same_share(depth, state.last) >= params.identical_share,
            BLOCKED_VIEW: blocked,
            BLURRED_VIEW: (state.edges > 0)
            & (seen.edges >= params.least_edges)
            & (seen.sharpness < params.blurred_share * state.sharpness),
            PART_EMPTY: jnp.any(bare & judged) & ~(blocked & jnp.all(bare | ~judged)),  # not a part, but all
            LATE_ARRIVAL: delay > params.late,
            SKEWED_STAMP: skewed,
        }
    )

    learn = jnp.asarray(learning) & (reasons == 0)
    learnt = state.learnt + learn.astype(state.learnt.dtype)
    weight = jnp.where(learn, 1 / jnp.maximum(learnt, 1), 0)
    edges = state.edges + jnp.where(learn, seen.edges, 0)
    edge_weight = jnp.where(learn, seen.edges / jnp.maximum(edges, 1), 0)
    state = HealthState(
        last=depth,
        stamp=jnp.where(skewed, state.stamp, stamp),
        arrived=jnp.where(finite, jnp.maximum(arrived, state.arrived), state.arrived),
        measured=state.measured + weight * (seen.measured - state.measured),
        sharpness=state.sharpness + edge_weight * (seen.sharpness - state.sharpness),
        edges=edges,
        delay=state.delay + weight * (delay - state.delay),
        learnt=learnt,
    )
    return state, reasons


def silent(params: HealthParams, state: HealthState, now: Float[Array, ""], period: Scalar) -> Int[Array, ""]:
    """NO_IMAGE if the last image arrived too long ago, or none ever did.

    Args:
        params: thresholds.
        state: of this camera.
        now: on the host's clock [s].
        period: between two images [s].
    """
    return pack({NO_IMAGE: ~(now - state.arrived <= params.silence * period)})
