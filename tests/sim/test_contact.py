"""The cell's choice of the mass in a contact: what the tick tells the monitor, and what the monitor makes of it."""

from dataclasses import replace
from functools import partial

import equinox as eqx
import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import pytest

from hrcjax.cells import CELLS, make_cell
from hrcjax.cells.check import check_cell
from hrcjax.numerics import unrolled_options
from hrcjax.reference.episode import episode
from hrcjax.safety import BODY_REGIONS, RED, SafetyParams, ZoneParams, initial_zone
from hrcjax.sim import Cell, FieldPart, Fields, Params, Separation, separation_monitor
from hrcjax.sim.contact import contact_mobility_rows
from hrcjax.sim.parts import Reading
from hrcjax.sim.tick import control_motion, read_room


def shown(params, fields, x):
    """Two points, one of which is near; a third surface that is far and has no direction."""
    gap = x - fields.static
    size = jnp.linalg.norm(gap, axis=-1)
    d, g = jnp.append(size, 10.0), jnp.concatenate([gap / size[:, None], jnp.zeros((1, 3))])
    return Reading(d[0], g[0], d, g, d[0], g[0])


@pytest.fixture(scope="module")
def cells() -> dict[str, Cell]:
    arm = make_cell().arm
    field = FieldPart(lambda params, frames: Fields(None, None), shown)
    return {name: Cell(arm=arm, field=field, contact_mass=name) for name in ("standard", "reflected")}


PEOPLE = np.array([[0.75, 0.2, 0.3], [0.1, 0.8, 0.9]])
decide = jax.jit(separation_monitor)


@pytest.fixture(scope="module")
def told(cells: dict[str, Cell]) -> dict[str, Separation]:
    """What the monitor of each cell gets."""
    q, people = jnp.asarray(cells["standard"].arm.home) + 0.2, jnp.asarray(PEOPLE)
    return {name: jax.jit(partial(separation_of, cell))(q, people) for name, cell in cells.items()}


def separation_of(cell: Cell, q, people):
    body, tool = control_motion(cell, q, jnp.zeros_like(q))
    rows = read_room(Params(), cell, Fields(people, None), body)[1]
    mobility = contact_mobility_rows(cell, q, tool, rows)
    return Separation(
        rows.distance, rows.speeds(jnp.zeros_like(q)), jnp.asarray(0.05), jnp.asarray(True), jnp.asarray(False), 0.008, mobility
    )  # fmt: skip


def test_the_speed_of_every_row_against_mujoco(cells: dict[str, Cell], told: dict[str, Separation]) -> None:
    """In red every row that has a direction gets the slowest region's speed by MuJoCo's mass, or the red speed."""
    cell, safety = cells["reflected"], SafetyParams(zone=ZoneParams(red_follows_separation=False))
    arm = cell.arm
    q = np.asarray(arm.home) + 0.2
    separation = told["reflected"]
    far = replace(separation, distance=jnp.full_like(separation.distance, 0.45))
    _, decision = decide(safety, initial_zone(jnp.float64), far)
    assert int(decision.zone) == RED
    data = mujoco.MjData(arm.model)
    data.qpos[:] = q
    mujoco.mj_forward(arm.model, data)
    M = np.zeros((6, 6))
    mujoco.mj_fullM(arm.model, data, M)

    def jacobian(link, offset):
        body, J = int(arm.model.jnt_bodyid[link]), np.zeros((3, 6))
        place = data.xpos[body] + data.xmat[body].reshape(3, 3) @ offset
        mujoco.mj_jac(arm.model, data, J, None, place, body)
        return place, J

    J_tool = jacobian(arm.tool_link, arm.tool_offset)[1]
    M += safety.pfl.payload * J_tool.T @ J_tool
    limit = np.asarray(decision.point_limit).reshape(-1, 3)
    seen = 0
    for k, (link, offset) in enumerate(zip(arm.control_links, arm.control_offsets, strict=True)):
        place, J = jacobian(link, offset)
        for s, there in enumerate(PEOPLE):
            u = (place - there) / np.linalg.norm(place - there)
            mobility = u @ J @ np.linalg.solve(M, J.T @ u)
            by_mass = min(
                r.force * r.transient / np.sqrt(r.stiffness / (1 / r.mass + mobility)) for r in BODY_REGIONS
            )  # an upper bound: points next to it may be heavier
            assert limit[k, s] <= by_mass * (1 + 1e-9)
            assert limit[k, s] >= 65 / np.sqrt(4.4 * 75e3) - 1e-12
            seen += limit[k, s] > 0.95 * by_mass and by_mass < 0.25
    assert seen > len(limit), "most are near that bound"
    assert limit[:, :2].min() < 0.1368 < limit[:, :2].max(), "heavier and lighter than the standard's 9.525 kg"
    assert (limit[:, 2] >= limit[:, :2].max() - 1e-12).all(), "what is far and has no direction decides nothing"


def test_derivatives_in_red_by_payload_and_posture(cells: dict[str, Cell]) -> None:
    """Finite for a stretched arm too, and more payload slows."""
    zone = ZoneParams(red_follows_separation=False)

    def total(q, payload):
        seen = separation_of(cells["reflected"], q, jnp.asarray(PEOPLE))
        near = replace(seen, distance=jnp.full_like(seen.distance, 0.45))
        params = eqx.tree_at(lambda p: p.pfl.payload, SafetyParams(zone=zone), payload)
        return jnp.sum(separation_monitor(params, initial_zone(jnp.float64), near)[1].point_limit[::3])

    gradient = jax.jit(jax.value_and_grad(total, (0, 1)), compiler_options=unrolled_options())
    for q in (jnp.zeros(6), jnp.asarray(cells["reflected"].arm.home) + 0.2):
        value, (by_q, by_payload) = gradient(q, 1.0)
        assert np.isfinite(by_q).all() and by_payload < 0
        step = 1e-5
        change = (gradient(q, 1.0 + step)[0] - gradient(q, 1.0 - step)[0]) / (2 * step)
        np.testing.assert_allclose(by_payload, change, rtol=1e-4)
    along = jnp.asarray([0.3, -0.2, 0.5, 0.1, -0.4, 0.2])
    change = (gradient(q + step * along, 1.0)[0] - gradient(q - step * along, 1.0)[0]) / (2 * step)
    np.testing.assert_allclose(by_q @ along, change, rtol=1e-4)
    assert np.isfinite(value)


def test_no_speed_that_is_not_a_number_passes(told: dict[str, Separation]) -> None:
    separation = told["reflected"]
    broken = replace(separation, mobility=replace(separation.mobility, M=jnp.full((6, 6), jnp.nan)))
    _, decision = decide(SafetyParams(), initial_zone(jnp.float64), broken)
    assert bool(decision.hold) and not np.asarray(decision.point_limit).any()


def test_off_is_as_if_it_were_not_there(told: dict[str, Separation]) -> None:
    """No mobility is told, and the monitor's program is that of a separation made without it."""
    separation, with_mass = told["standard"], told["reflected"]
    assert separation.mobility is None
    parts = {name: getattr(separation, name) for name in ("distance", "approach", "age", "valid", "guarded", "dt")}

    def program(given: Separation) -> str:
        return decide.lower(SafetyParams(), initial_zone(jnp.float64), given).as_text()

    assert program(separation) == program(Separation(**parts))
    assert program(with_mass) != program(separation)
    for name in parts:
        np.testing.assert_array_equal(parts[name], getattr(with_mass, name))


def test_the_named_cell_asks_for_it() -> None:
    """And its kept programs are its own."""
    named = {name: make() for name, make in CELLS.items()}
    assert [name for name, one in named.items() if one.cell.contact_mass == "reflected"] == ["ur5-reflected"]
    assert len({one.identity for one in named.values()}) == len(named)
    check_cell(named["ur5-reflected"])


def test_other_masses_are_refused(cells: dict[str, Cell]) -> None:
    with pytest.raises(ValueError, match="contact_mass 'heavy'; accepted: standard, reflected"):
        replace(cells["standard"], contact_mass="heavy")
    with pytest.raises(ValueError, match="contact_mass 'reflected'; the reference accepts: standard"):
        episode(Params(), cells["reflected"], None, None, cells["reflected"].arm.home)
