"""The body of a person in the tick: what it changes beside somebody who stands, comes, goes or is not known, and what it may not change."""

from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from hrcjax.body import JOINTS, BodyFit, BodyParams, part_capsules
from hrcjax.body.skeleton import HEAD_PART, USUAL_LENGTHS, USUAL_RADII
from hrcjax.cells import CELLS, make_cell
from hrcjax.geom.segment import FAR
from hrcjax.reference.episode import episode
from hrcjax.robot import COVER_MARGIN
from hrcjax.safety import BODY_REGIONS, GREEN, HEAD_NEAR, RED, STOP, ZoneParams, initial_zone, pfl_speeds
from hrcjax.sim import Cell, FieldPart, Fields, Params, Sensed, Separation, separation_monitor, tick
from hrcjax.sim.body_rows import body_rows
from hrcjax.sim.parts import Goal, Reading
from hrcjax.sim.tick import control_motion, initial_state, read_room

PARAMS = Params()
SHAPE = np.array(
    [
        [0.0, 0.0, 0.0], [0.0, 0.0, 0.42], [0.0, -0.02, 0.69], [0.18, 0.0, 0.4], [-0.18, 0.0, 0.4], [0.2, 0.0, 0.1],
        [-0.2, -0.02, 0.12], [0.2, -0.1, -0.15], [-0.12, -0.27, 0.15], [0.2, -0.12, -0.25], [-0.1, -0.37, 0.15],
    ]
)  # fmt: skip
"""Joints about the hip of somebody who faces -y, the right hand in front [m]."""


def body(place: np.ndarray, velocity: tuple[float, float, float] = (0.0, 0.0, 0.0), **changed) -> BodyFit:
    """Somebody at a place, known well; all joints go alike."""
    assert len(SHAPE) == len(JOINTS)
    every = jnp.broadcast_to(jnp.eye(3), (11, 3, 3))
    fit = BodyFit(
        jnp.asarray(SHAPE + place), jnp.asarray(USUAL_RADII), jnp.broadcast_to(jnp.asarray(velocity), (11, 3)), 1e-5 * every,
        1e-4 * every, jnp.asarray(USUAL_LENGTHS), jnp.full((10,), 9.0), jnp.zeros((10,)), jnp.asarray(1.0), jnp.asarray(2.0),
        jnp.asarray(True), jnp.full((4, 3), 100.0),
    )  # fmt: skip
    return replace(fit, **{name: jnp.asarray(value) for name, value in changed.items()})


def read(params, fields: Fields, x) -> Reading:
    """The field of the body's own surface, exact, 5 cm too near; and of one point that may be anywhere."""
    joints, radii, point = fields.static
    capsules = part_capsules(joints, radii)
    axis = capsules.b - capsules.a
    along = jnp.clip(jnp.sum((x - capsules.a) * axis, axis=1) / jnp.sum(axis * axis, axis=1), 0, 1)
    gap = x - capsules.a - along[:, None] * axis
    size = jnp.linalg.norm(gap, axis=1)
    k = jnp.argmin(size - capsules.radius)
    other = x - point
    far = jnp.linalg.norm(other)
    d = jnp.stack([(size - capsules.radius)[k] - 0.05, far])
    g = jnp.stack([gap[k] / size[k], other / far])
    order = jnp.argsort(d)
    return Reading(jnp.asarray(5.0), g[0], d[order], g[order], jnp.asarray(5.0), g[0])


NOWHERE = np.array([0.0, 0.0, 8.0])


@pytest.fixture(scope="module")
def cell() -> Cell:
    return Cell(
        arm=make_cell().arm, field=FieldPart(lambda params, frames: Fields(None, None), read), body=BodyParams()
    )


@pytest.fixture(scope="module")
def told(cell: Cell):
    """(fit, point) -> what the monitor gets; with the body or without."""
    q = jnp.asarray(cell.arm.home) + 0.2

    def separation(fit: BodyFit, surface: BodyFit, point) -> Separation:
        at, _ = control_motion(cell, q, jnp.zeros_like(q))
        rows = read_room(PARAMS, cell, Fields((surface.joints, surface.radii, point), None), at)[1]
        age = jnp.asarray(0.06)
        found = body_rows(cell.body, fit, at.x, rows, age, 0.45)
        return Separation(
            rows.distance, jnp.zeros_like(rows.distance), age, jnp.asarray(True), jnp.asarray(False), cell.dt, None, rows.nearest(), found
        )  # fmt: skip

    program = jax.jit(separation)

    def tell(fit: BodyFit, point=NOWHERE, surface: BodyFit | None = None) -> Separation:
        return program(fit, fit if surface is None else surface, jnp.asarray(point))

    return tell


@pytest.fixture(scope="module")
def tool(cell: Cell) -> np.ndarray:
    q = jnp.asarray(cell.arm.home) + 0.2
    return np.asarray(control_motion(cell, q, 0 * q)[1].x[0])


SAFETY = PARAMS.safety
decide = jax.jit(lambda separation: separation_monitor(SAFETY, initial_zone(jnp.float64), separation))


def without(separation: Separation) -> Separation:
    return replace(separation, body=None)


def beside(tool: np.ndarray, gap: float) -> np.ndarray:
    """A hip with which the right hand is so far from the tool, in the direction of -y [m]."""
    return tool + np.array([0.1, 0.37 + USUAL_RADII[5] + gap, -0.15])


def test_beside_somebody_who_stands_the_arm_is_faster(told, tool: np.ndarray) -> None:
    """Nearer than the assumed speed allows; faster beyond."""
    zones = {}
    for gap in (0.45, 0.6, 0.9):
        separation = told(body(beside(tool, gap)))
        assert separation.body is not None and bool(separation.body.counts[jnp.argmin(separation.distance)])
        (_, with_body), (_, assumed) = decide(separation), decide(without(separation))
        assert with_body.zone <= assumed.zone
        assert float(with_body.speed_limit) > float(assumed.speed_limit) + 0.02
        zones[gap] = int(assumed.zone), int(with_body.zone)
    assert zones[0.45][0] == STOP > zones[0.45][1]


@pytest.mark.parametrize("gap", [0.45, 0.7])
def test_who_comes_is_approached_slower_than_who_goes(told, tool: np.ndarray, gap: float) -> None:
    limits = [
        float(decide(told(body(beside(tool, gap), (0.0, way, 0.0))))[1].speed_limit) for way in (-0.8, 0.0, 0.8)
    ]  # fmt: skip
    assert limits[0] < limits[1] - 0.02 and limits[1] <= limits[2]
    assert limits[0] >= float(decide(without(told(body(beside(tool, gap)))))[1].speed_limit) - 1e-12


@pytest.mark.parametrize(
    "changed", [{"tracked": False}, {"age": 0.2}, {"explained": 0.8}, {"joints": np.full((11, 3), np.nan)}]
)
def test_a_track_that_is_not_sure_changes_nothing(told, tool: np.ndarray, changed: dict) -> None:
    """Exactly the decision without a body, near a hand and near a head."""
    for place in (beside(tool, 0.4), tool + np.array([0.0, 0.4, -0.6])):
        exact = body(place)
        separation = told(body(place, **changed), surface=exact)
        (state, found), expected = decide(separation), decide(without(separation))
        assert (np.asarray(found.head_limit) > 5).all()  # more than an arm can do
        for one, other in zip(
            jax.tree.leaves((state, replace(found, head_limit=None))), jax.tree.leaves(expected), strict=True
        ):
            np.testing.assert_array_equal(one, other)


def test_a_hidden_hand_is_assumed(told, tool: np.ndarray) -> None:
    place = beside(tool, 0.5)
    unseen = np.zeros(10)
    unseen[9] = 1.0
    seen, hidden = told(body(place)), told(body(place, unseen=unseen))
    slower = decide(hidden)[1].speed_limit
    assert slower < decide(seen)[1].speed_limit - 0.02
    np.testing.assert_allclose(slower, decide(without(hidden))[1].speed_limit, rtol=1e-9)


def test_points_that_no_part_explains_stay_points(told, tool: np.ndarray) -> None:
    """Beside somebody who stands 1 m away, one point at 0.4 m has the limit that it has without anybody known."""
    fit, point = body(beside(tool, 1.0)), tool + np.array([0.0, 0.0, -0.42])
    separation = told(fit, point)
    nearest = int(jnp.argmin(separation.distance))
    assert separation.body is not None and not bool(separation.body.counts[nearest])
    (_, found), (_, expected) = decide(separation), decide(without(separation))
    assert found.zone == expected.zone
    np.testing.assert_array_equal(found.point_limit[nearest], expected.point_limit[nearest])
    assert decide(told(fit))[1].speed_limit > found.speed_limit


def test_a_strange_point_beside_the_body_has_the_assumed_speed(told, tool: np.ndarray) -> None:
    """A hand of somebody else 12 cm before a person who stands still: it may come as fast as anybody."""
    away = np.array([0.0, 0.5, 0.0])
    fit = body(beside(tool, 0.62), strange=np.stack([tool + away, *np.full((3, 3), 100.0)]))
    alone = body(beside(tool, 0.62))
    with_hand, without_hand = told(fit, tool + away), told(alone, tool + away)
    nearest = int(jnp.argmin(with_hand.distance))
    assert not bool(with_hand.body.counts[nearest])
    (_, found), (_, expected) = decide(with_hand), decide(without(with_hand))
    np.testing.assert_array_equal(found.point_limit[nearest], expected.point_limit[nearest])
    assert bool(without_hand.body.counts[nearest])  # what the points of the image are for


def test_the_separation_is_never_above_the_field(told, tool: np.ndarray) -> None:
    """A field that reads nearer than the body counts; where it reads farther, the body does."""
    fit = body(beside(tool, 0.6))
    same, nearer, farther = (told(fit, surface=body(beside(tool, 0.6 + off))) for off in (0.0, -0.06, 0.1))
    assert decide(nearer)[1].speed_limit < decide(same)[1].speed_limit - 0.01
    for separation in (same, farther):
        assert separation.body is not None
        d = jnp.minimum(separation.distance, separation.body.distance)
        alone = replace(separation, body=replace(separation.body, distance=jnp.full_like(d, FAR)))
        for one, other in zip(
            jax.tree.leaves(decide(separation)), jax.tree.leaves(decide(replace(alone, distance=d))), strict=True
        ):
            np.testing.assert_array_equal(one, other)
        lower = bool((d < separation.distance).any())
        assert lower == (separation is farther)
        assert (decide(separation)[1].speed_limit < decide(alone)[1].speed_limit) == lower


def test_the_head_stops_the_arm(told, tool: np.ndarray) -> None:
    """At 0.5 m of the exact head, by the reason "head near", with no other part within the distance of a stop."""
    height = SHAPE[1, 2] + 0.6 * (SHAPE[2, 2] - SHAPE[1, 2])
    found = {}
    for gap in (0.45, 0.9):
        place = tool + np.array([0.0, gap + USUAL_RADII[2], 0.25 - height])
        fit = body(place)
        low = eqx.tree_at(lambda f: f.joints, fit, fit.joints.at[3:].add(jnp.asarray([0.0, 0.6, 0.0])))
        separation = told(low)
        capsules = part_capsules(low.joints, low.radii)
        assert separation.body is not None
        found[gap] = decide(separation)[1]
        head = Capsule(capsules, HEAD_PART)
        expected = [head.gap(x) - r for x, r in points(separation, tool)]
        np.testing.assert_allclose(separation.body.head_distance, expected, atol=1e-6)
    assert bool(found[0.45].reasons & HEAD_NEAR) and found[0.45].zone == STOP
    assert not bool(found[0.9].reasons & HEAD_NEAR)


def test_the_arm_retreats_from_a_head(cell: Cell, tool: np.ndarray) -> None:
    """Whatever the policy asks for, no point near the head approaches it, and the nearest go away; far from it the arm goes on."""
    height = SHAPE[1, 2] + 0.6 * (SHAPE[2, 2] - SHAPE[1, 2])
    q0 = jnp.asarray(cell.arm.home) + 0.2
    asks = replace(cell, policy=lambda params, arm, goal, room, limits: jnp.asarray([0.5, -0.4, 0.3, 0.2, 0.1, 0.6]))
    lead = Goal(jnp.zeros((3, 3)), jnp.zeros((3, 3)), jnp.zeros((3, 3)), q0, jnp.zeros(3), PARAMS.potential)

    @jax.jit
    def played(fit: BodyFit):
        fields = Fields((fit.joints, fit.radii, jnp.asarray(NOWHERE)), None)
        sensed = Sensed(fields, jnp.asarray(0.06), jnp.asarray(True), jnp.asarray(False), jnp.asarray(0), body=fit)

        def one(state, _):
            state, record = tick(PARAMS, asks, lead, sensed, state)
            x = control_motion(asks, record.q, record.qd)[0].x
            return state, (x, record.reasons)

        return jax.lax.scan(one, initial_state(asks, q0), None, length=100)[1]

    radii = np.asarray(cell.arm.control_radii) + COVER_MARGIN
    moved = {}
    for gap in (0.45, 1.5):
        fit = body(tool + np.array([0.0, gap + USUAL_RADII[2], 0.25 - height]))
        low = eqx.tree_at(lambda f: f.joints, fit, fit.joints.at[3:].add(jnp.asarray([0.0, 0.6, 0.0])))
        x, reasons = (np.asarray(v) for v in played(low))
        head = Capsule(part_capsules(low.joints, low.radii), HEAD_PART)
        gaps = np.asarray([[head.gap(p) for p in row] for row in x]) - radii
        moved[gap] = np.abs(x[-1] - x[0]).max()
        if gap == 0.45:
            near = gaps[:-1] < 0.5
            assert near.any() and (reasons[0] & HEAD_NEAR)
            assert (np.diff(gaps, axis=0)[near] > -1e-4).all()
            assert gaps[-1].min() > gaps[0].min() + 0.02
    assert moved[1.5] > 0.05


class Capsule:
    """One capsule in NumPy."""

    def __init__(self, capsules, k: int) -> None:
        self.a, self.b, self.r = (np.asarray(v, float)[k] for v in (capsules.a, capsules.b, capsules.radius))

    def gap(self, x: np.ndarray) -> float:
        """Distance of a place to its surface [m]."""
        axis = self.b - self.a
        t = np.clip((x - self.a) @ axis / (axis @ axis), 0, 1)
        return float(np.linalg.norm(x - self.a - t * axis) - self.r)


def points(separation: Separation, tool: np.ndarray) -> list[tuple[np.ndarray, float]]:
    """Control points of the arm with their radii, the margin of their spheres included."""
    arm = make_cell().arm
    cell = Cell(arm=arm)
    q = jnp.asarray(arm.home) + 0.2
    x = np.asarray(control_motion(cell, q, 0 * q)[0].x)
    return [(p, r + COVER_MARGIN) for p, r in zip(x, arm.control_radii, strict=True)]


def test_the_contact_speed_is_that_of_the_region(told, tool: np.ndarray) -> None:
    """In red beside a hand alone: the hand's, not the face's; where nothing is known, the face's."""
    params = replace(SAFETY, zone=ZoneParams(red_follows_separation=False, red_speed=5.0, nominal_speed=9.0))
    red = eqx.tree_at(lambda s: s.zone, initial_zone(jnp.float64), jnp.asarray(RED, jnp.int32))
    separation = told(body(beside(tool, 0.6)))
    nearest = int(jnp.argmin(separation.distance))
    look = jax.jit(lambda given: separation_monitor(params, red, given)[1])
    speeds = np.asarray(pfl_speeds(1 / (17.05 / 2 + 1.0)))  # the standard's mass
    regions = [region.name.split(",")[0] for region in BODY_REGIONS]
    hand, face = speeds[regions.index("hand")], speeds[regions.index("face")]
    assert look(without(separation)).point_limit[nearest] == pytest.approx(face)
    assert face < look(separation).point_limit[nearest] <= hand + 1e-9


def test_in_a_tick(cell: Cell, tool: np.ndarray) -> None:
    """The limit in the record differs by the body, and without one it is that of a cell that does not follow it."""
    q = jnp.asarray(cell.arm.home) + 0.2
    fit = jax.tree.map(lambda a: a, body(beside(tool, 0.5)))
    lead = Goal(jnp.zeros((3, 3)), jnp.zeros((3, 3)), jnp.zeros((3, 3)), q, jnp.zeros(3), PARAMS.potential)

    def limit(cell: Cell, given: BodyFit | None):
        fields = Fields((fit.joints, fit.radii, jnp.asarray(NOWHERE)), None)
        sensed = Sensed(fields, jnp.asarray(0.06), jnp.asarray(True), jnp.asarray(False), jnp.asarray(0), body=given)
        record = tick(PARAMS, cell, lead, sensed, initial_state(cell, q))[1]
        return record.speed_limit, record.zone

    calm = replace(cell, policy=lambda params, arm, goal, room, limits: jnp.zeros_like(arm.q))
    off = replace(calm, body=None)
    with_body, zone = jax.jit(lambda: limit(calm, fit))()
    others = jax.jit(lambda: limit(off, fit))(), jax.jit(lambda: limit(calm, None))()
    assert others[0] == others[1]
    assert with_body > others[0][0] + 0.02
    assert zone != GREEN and with_body < FAR


def test_the_named_cell_and_the_reference() -> None:
    named = {name: make() for name, make in CELLS.items()}
    assert [name for name, one in named.items() if one.cell.body is not None] == ["ur5-body"]
    assert len({one.identity for one in named.values()}) == len(named)
    with pytest.raises(ValueError, match="body"):
        episode(Params(), named["ur5-body"].cell, None, None, named["ur5-body"].cell.arm.home)
