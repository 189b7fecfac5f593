"""Places for the tool: each refusal with its reason, against exact shapes."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from hrcjax.bits import words
from hrcjax.geom.shape import box_distance, column_distance, plane_distance
from hrcjax.hand import Line, PointingParams, pointed_place
from hrcjax.hand.pointing import Pointed
from hrcjax.robot import load_arm, tool_frame, with_tool
from hrcjax.sim import PLACE_REASONS, Cell, PlaceParams, chosen_place, describe_place, tool_place
from hrcjax.sim.chosen_place import NO_ROOM, NOTHING, OUT_OF_REACH, UNSURE

PARAMS = PlaceParams()
UP = (0.0, 0.0, 1.0)


@pytest.fixture(scope="module")
def arm_cell() -> Cell:
    return Cell(arm=with_tool(load_arm("ur5"), 0.12, 0.03))


def table(x):
    return plane_distance(x, jnp.asarray(UP, x.dtype), 0.0)


def beside_a_column(x):
    """The table, and a column of 3 cm radius and 20 cm height at (0.4, 0.3)."""
    column = column_distance(x, jnp.asarray([0.4, 0.3, 0.1], x.dtype), 0.03, 0.1)
    return jnp.minimum(table(x), column)


def pointed(place, deviation: float = 0.01, found: bool = True) -> Pointed:
    covariance = deviation**2 * jnp.eye(3)
    return Pointed(jnp.asarray(place, jnp.float32), covariance, jnp.asarray(found), jnp.asarray(False))


def reasons(place, distance=table, **given) -> int:
    return int(jax.jit(lambda p: tool_place(PARAMS, p, distance))(pointed(place, **given)).reasons)


def test_a_place_on_the_table_is_taken_above_it(arm_cell: Cell) -> None:
    choice = chosen_place(PARAMS, arm_cell, pointed((0.4, 0.3, 0.0)), table)
    assert choice.reasons == 0 and describe_place(choice.reasons) == "none"
    np.testing.assert_allclose(choice.x, [0.4, 0.3, PARAMS.above], atol=1e-6)
    assert choice.q is not None
    R, p = tool_frame(arm_cell.arm, choice.q)
    np.testing.assert_allclose(p, choice.x, atol=2e-3)
    np.testing.assert_allclose(R[:, 2], [0, 0, -1], atol=0.02)


def test_the_tool_stands_off_along_the_normal() -> None:
    def wall(x):
        return box_distance(x, jnp.asarray([0.5, 0.0, 0.5], x.dtype), jnp.asarray([0.1, 0.4, 0.5], x.dtype), 0.3)

    # a place on the wall's face, by its own frame
    c, s = np.cos(0.3), np.sin(0.3)
    face = np.array([0.5, 0.0, 0.5]) + np.array([-0.1 * c, -0.1 * s, 0.0])
    found = tool_place(PARAMS, pointed(face), wall)
    assert int(found.reasons) == 0
    np.testing.assert_allclose(found.normal, [-c, -s, 0.0], atol=1e-4)
    np.testing.assert_allclose(found.x, face + PARAMS.above * np.array([-c, -s, 0.0]), atol=1e-4)


def test_where_the_line_meets_nothing_there_is_no_place(arm_cell: Cell) -> None:
    line = Line(jnp.asarray([0.4, 0.3, 0.5]), jnp.asarray(UP), 1e-6 * jnp.eye(6))
    choice = chosen_place(PARAMS, arm_cell, pointed_place(PointingParams(), line, table), table)
    assert choice.reasons == NOTHING and choice.q is None
    nowhere = pointed((0.4, 0.3, float("nan")))
    assert chosen_place(PARAMS, arm_cell, nowhere, table).reasons & NOTHING


def test_a_place_that_is_not_known_is_refused() -> None:
    limit = PARAMS.unsure
    assert reasons((0.4, 0.3, 0.0), deviation=0.98 * limit) == 0
    assert reasons((0.4, 0.3, 0.0), deviation=1.02 * limit) == UNSURE
    assert reasons((0.4, 0.3, 0.0), deviation=float("nan")) & UNSURE


def test_a_place_out_of_reach_is_refused(arm_cell: Cell) -> None:
    for place in ((1.2, 0.0, 0.0), (0.02, 0.0, 0.0)):
        choice = chosen_place(PARAMS, arm_cell, pointed(place), table)
        assert choice.reasons == OUT_OF_REACH and choice.q is None


def test_beside_an_obstacle_the_tool_needs_room(arm_cell: Cell) -> None:
    """By the column the tool needs its radius and the room about it from the column's mantle."""
    least = 0.03 + PARAMS.radius + PARAMS.room
    for gap, expected in ((least + 0.003, 0), (least - 0.003, NO_ROOM), (0.035, NO_ROOM)):
        assert reasons((0.4 + gap, 0.3, 0.0), beside_a_column) == expected
    assert chosen_place(PARAMS, arm_cell, pointed((0.45, 0.3, 0.0)), beside_a_column).q is None
    assert reasons((0.4, 0.3, 0.2), beside_a_column) == 0, "on top of it there is room"


def test_under_a_shelf_there_is_no_room_for_the_tool() -> None:
    def under(height: float):
        def distance(x):
            shelf = box_distance(
                x, jnp.asarray([0.4, 0.3, height + 0.01], x.dtype), jnp.asarray([0.2, 0.2, 0.01], x.dtype)
            )
            return jnp.minimum(table(x), shelf)

        return distance

    need = PARAMS.above + max(PARAMS.tool, PARAMS.approach) + PARAMS.radius + PARAMS.room
    assert reasons((0.4, 0.3, 0.0), under(need + 0.01)) == 0
    assert reasons((0.4, 0.3, 0.0), under(need - 0.01)) == NO_ROOM


def test_a_field_that_is_no_number_leaves_no_room() -> None:
    assert reasons((0.4, 0.3, 0.0), lambda x: table(x) * jnp.nan) & NO_ROOM
    assert reasons((0.4, 0.3, 0.0), lambda x: 0.0 * x[2] + 1.0) == NO_ROOM, "nor one without a direction"


def test_every_reason_has_words() -> None:
    assert words(PLACE_REASONS, NOTHING | UNSURE | NO_ROOM | OUT_OF_REACH).count(";") == 3
    assert describe_place(jnp.asarray(UNSURE | NO_ROOM)).split("; ") == [PLACE_REASONS[UNSURE], PLACE_REASONS[NO_ROOM]]
