"""The program that measures safety: exact exposure, variants of the monitor, chance, lost time, the rows on cases made by hand."""

from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from experiments.safety import rows
from experiments.safety.config import SafetyConfig, parse
from experiments.safety.contact_ratio import NEAR, REGIONS_OF, ContactRatio
from experiments.safety.deviation import clock_motion, from_curve
from experiments.safety.draws import Drawer, images_in_use, moved, played_at
from experiments.safety.exact_field import EXACT_FIELD, Margin, Shapes
from experiments.safety.exposure import exposed, towards
from experiments.safety.limits import upper_limit
from experiments.safety.lost_time import lost_by_zone
from experiments.safety.page import command, page
from experiments.safety.run import run
from experiments.safety.variants import (
    UNBOUNDED,
    VARIANTS,
    batch_axes,
    contact_speed,
    switches,
    variant_part,
    with_variants,
)
from hrcjax.cells import make_cell
from hrcjax.field.grid import GridLayout, fit_grid
from hrcjax.geom.capsules import Capsules
from hrcjax.lab.errors import UsageError
from hrcjax.reference.truth import approach_speeds, person_distances
from hrcjax.robot import mass_matrix, point_motion
from hrcjax.robot.link_spheres import link_spheres
from hrcjax.safety import (
    BODY_REGIONS,
    ContactMobility,
    SafetyParams,
    allowed_speed,
    effective_mass,
    pfl_speeds,
    separation_distance,
)
from hrcjax.sim import Cell, Fields, Params, Separation, separation_monitor
from hrcjax.world import Person, person_at, robotica
from hrcjax.world.person import REGIONS


@pytest.fixture(scope="module")
def cell() -> Cell:
    return make_cell()


def numbers(tree):
    return jax.tree.map(lambda leaf: jnp.asarray(leaf, jnp.float64), tree)


# exposure


def test_distance_and_approach_against_mujoco(cell: Cell) -> None:
    draw = np.random.default_rng(0)
    count = 12
    a = np.array([0.6, 0.5, 0.3]) + 0.1 * draw.normal(size=(count, 3, 3))
    b = a + np.array([0, 0, 0.2])
    person = Person(
        *(jnp.asarray(x) for x in (a, b, np.array([0.05, 0.1, 0.08]), 10.0, np.ones(count, bool))),
        ("hand", "forearm", "chest"),
    )
    t = 0.1 * np.arange(count)
    q = cell.arm.home + 0.3 * draw.normal(size=(count, 6))
    qd = draw.normal(size=(count, 6))
    people = jax.vmap(lambda one: person_at(person, one))(jnp.asarray(t))
    d, v = jax.jit(jax.vmap(lambda *at: towards(cell.arm, *at)))(jnp.asarray(q), jnp.asarray(qd), people)
    watched = np.asarray(cell.arm.capsule_links) >= min(cell.arm.control_links)
    every = person_distances(cell.arm, person, q, t)
    true = every[:, watched].min(axis=(1, 2))
    nearest = np.asarray(d).argmin(axis=1)
    near = np.asarray(d)[np.arange(count), nearest]
    assert np.all(near - true >= -1e-9) and np.all(near - true < 0.002), "spheres 3 cm apart stand for capsules"
    at = (near - true < 1e-4) & (every.min(axis=(1, 2)) == true)
    assert at.sum() > 3
    speeds = approach_speeds(cell.arm, person, q, qd, t)
    np.testing.assert_allclose(np.asarray(v)[np.arange(count), nearest][at], speeds[at], atol=0.05)


def test_nobody_is_far_and_not_approached(cell: Cell) -> None:
    nobody = Capsules(jnp.zeros((2, 3)), jnp.ones((2, 3)), -jnp.ones(2))
    q = jnp.asarray(cell.arm.home)
    d, v = towards(cell.arm, q, jnp.ones(6), nobody)
    assert np.all(d == 10) and np.all(v == 0) and len(d) == len(link_spheres(cell.arm)[0])


def test_excess_is_by_the_largest_distance_and_by_the_best_pose_within_the_reaction_time(cell: Cell) -> None:
    """A still person and an arm that turns towards it at a known speed; then the person jumps near, or to the other side."""
    ssm = numbers(SafetyParams()).ssm
    q0 = np.asarray(cell.arm.home, float)
    ticks, window = 8, 3
    q = jnp.asarray(np.repeat(q0[None], ticks, axis=0))
    qd = jnp.asarray(np.repeat(np.array([[0.6, 0, 0, 0, 0, 0]]), ticks, axis=0))
    tip = np.asarray(person_tip(cell, q0))
    side = np.array([-tip[1], tip[0], 0]) / np.hypot(tip[0], tip[1])
    gap = np.where(np.arange(ticks) < 4, 0.9, 0.2)
    at = jnp.asarray((tip + gap[:, None] * side)[:, None])
    person = Capsules(at, at, jnp.full((ticks, 1), 0.01))
    seen = jax.jit(lambda *x: exposed(cell.arm, ssm, window, *x))(q, qd, person)
    excess, now = np.asarray(seen.excess), np.asarray(seen.excess_now)
    assert np.all(excess[:7] < 0), "what came within three ticks could not be known"
    assert now[4] > 0.2 and excess[7] == pytest.approx(now[7]) and excess[7] > 0.2
    speed = np.asarray(seen.approach)
    assert speed[0] > 0.2 and np.all(np.asarray(seen.short)[4:] > np.asarray(seen.short)[0])
    still = jax.jit(lambda *x: exposed(cell.arm, ssm, window, *x))(q, 0 * qd, person)
    assert np.max(still.short) < 0 and np.max(still.excess) <= 0
    # away from somebody at 0.2 m who is suddenly on the side that the arm turns to: the way is wrong, the distance the same
    other = jnp.asarray((tip + np.where(np.arange(ticks) < 4, -0.2, 0.2)[:, None] * side)[:, None])
    seen = jax.jit(lambda *x: exposed(cell.arm, ssm, window, *x))(q, qd, Capsules(other, other, person.radius))
    assert np.max(seen.excess_now[:4]) < 0.05 < 0.2 < seen.excess_now[4]
    assert seen.excess[4] > 0.2, "the largest distance forgives no direction"
    assert np.max(seen.excess_pose[4:7]) < 0.05 < 0.2 < seen.excess_pose[7] == pytest.approx(float(seen.excess_now[7]))


def person_tip(cell: Cell, q: np.ndarray) -> np.ndarray:
    links, offsets, _ = link_spheres(cell.arm)
    from hrcjax.robot import points_on_links

    return np.asarray(points_on_links(cell.arm.chain, jnp.asarray(q), links[-1:], offsets[-1:])[0])


# variants


def seen(cell: Cell, near: int, d: float) -> Separation:
    """One point near a person, the others far; three surfaces each."""
    distance = np.full((len(cell.arm.control_links), 3), 10.0)
    distance[near, 0] = d
    approach = np.zeros(distance.size)
    return Separation(
        jnp.asarray(distance.ravel()), jnp.asarray(approach), jnp.asarray(0.05), jnp.asarray(True), jnp.asarray(False), 0.008
    )  # fmt: skip


def limit(cell: Cell, variant: str, near: int, d: float, ticks: int = 1):
    part, params = variant_part(cell.arm), numbers(switches(SafetyParams(), variant))
    memory = part.start(jnp.float64)
    for _ in range(ticks):
        memory, decision = part.decide(params, memory, seen(cell, near, d))
    return decision.point_limit.reshape(-1, 3)[near, 0], decision


def test_what_the_variants_allow(cell: Cell) -> None:
    safety = numbers(SafetyParams())
    elbow, hand = cell.arm.control_links.index(1), len(cell.arm.control_links) - 1
    assert cell.arm.control_links[hand] == cell.arm.tool_link
    plain = separation_monitor(safety, variant_part(cell.arm).start(jnp.float64), seen(cell, elbow, 0.7))[1]
    assert eqx.tree_equal(limit(cell, "zones", elbow, 0.7)[1], plain)
    assert limit(cell, "tool", elbow, 0.1)[0] == safety.zone.nominal_speed, "an elbow that the tool's distance misses"
    assert limit(cell, "tool", hand, 0.7)[0] == limit(cell, "zones", hand, 0.7)[0] < 1
    assert limit(cell, "off", hand, 0.0)[0] == UNBOUNDED and not limit(cell, "off", hand, 0.0)[1].hold
    pfl = limit(cell, "pfl", hand, 0.0)
    assert pfl[0] == contact_speed(safety) < 1 and np.max(pfl[1].point_limit) == contact_speed(safety)
    bare = replace(SafetyParams().ssm, intrusion=0.0, Z_d=0.0, Z_r=0.0)
    d = 0.7
    np.testing.assert_allclose(limit(cell, "contact_stop", hand, d)[0], allowed_speed(numbers(bare), d), rtol=1e-9)
    assert limit(cell, "contact_stop", hand, d)[0] > limit(cell, "zones", hand, d)[0]
    only = separation_distance(bare, 0.0, bare.v_h_near)
    assert limit(cell, "contact_stop", hand, float(only) - 1e-3)[0] == 0


def test_the_reflected_mass_is_for_its_variant_alone(cell: Cell) -> None:
    """Heavy and light rows: slower and faster than the standard's mass allows; the others do not look at it."""
    safety, hand = numbers(SafetyParams()), len(cell.arm.control_links) - 1
    plain = seen(cell, hand, 0.5)
    A = jnp.zeros((plain.distance.shape[0], 6)).at[:, 1].set(jnp.linspace(0.0, 1.0, plain.distance.shape[0]))
    mobility = ContactMobility(jnp.eye(6), jnp.zeros((3, 6)), A, A, A, jnp.ones(len(A), bool))
    told = replace(plain, mobility=mobility)
    part, memory = variant_part(cell.arm), variant_part(cell.arm).start(jnp.float64)
    decide = jax.jit(part.decide)
    for variant in VARIANTS:
        params = numbers(switches(SafetyParams(), variant))
        without, with_mass = (decide(params, memory, s)[1] for s in (plain, told))
        assert bool(eqx.tree_equal(without, with_mass)) == (variant != "pfl_reflected")
    found = np.asarray(decide(numbers(switches(SafetyParams(), "pfl_reflected")), memory, told)[1].point_limit)
    assert found[0] < contact_speed(safety) < found[-1] and (np.diff(found) > 0).all()
    by_cell = jax.jit(variant_part(cell.arm, "reflected").decide)(
        numbers(switches(SafetyParams(), "zones")), memory, told
    )[1]
    assert eqx.tree_equal(by_cell, jax.jit(separation_monitor)(safety, memory, told)[1])


def test_contact_ratios_against_the_library(cell: Cell) -> None:
    """Random motions beside a hand and a head: the same from the library's kinematics, inertia and table, point by point."""
    safety, arm = SafetyParams(), cell.arm
    ratio, (links, offsets, radii) = ContactRatio(arm, safety.pfl), link_spheres(arm)
    links = (*links, arm.tool_link)
    offsets = np.concatenate([offsets, arm.tool_offset[None]])
    at = jax.jit(lambda q: (point_motion(arm.chain, q, jnp.zeros_like(q), links, offsets), mass_matrix(arm.chain, q)))
    speeds = jax.jit(jax.vmap(pfl_speeds))
    by_name = {"hand": [9], "head": [0, 1]}
    draw, met = np.random.default_rng(2), set()
    for _ in range(12):
        q, qd = draw.uniform(-np.pi, np.pi, 6), draw.normal(size=6)
        moved, M = jax.tree.map(np.asarray, at(jnp.asarray(q)))
        a = moved.x[-1] + draw.normal(size=(2, 3)) * 0.12
        b, radius = a + np.array([0, 0, 0.2]), np.array([0.05, 0.06])
        inverse = np.linalg.inv(M + safety.pfl.payload * moved.J[-1].T @ moved.J[-1])
        rows, regions = [], []
        for x, J, r in zip(moved.x[:-1], moved.J[:-1], radii, strict=True):
            gaps = np.array(
                [x - np.clip(x, low, high) for low, high in zip(a, b, strict=True)]
            )  # upright: a box without width
            free = np.linalg.norm(gaps, axis=1) - radius - r
            k = int(free.argmin())
            if free[k] < NEAR:
                rows.append(-gaps[k] @ J / np.linalg.norm(gaps[k]))
                regions.append("hand" if k == 0 else "head")
        A = np.stack(rows)
        felt = np.asarray(speeds(jnp.asarray(np.einsum("ri,ij,rj->r", A, inverse, A))))
        rule = float(jnp.min(pfl_speeds(1 / effective_mass(safety.pfl))))
        own = [v[by_name[name]].min() for v, name in zip(felt, regions, strict=True)]
        expected = [max((A @ qd / v).max(), 0.0) for v in (np.array(own), felt.min(axis=1), np.full(len(A), rule))]
        np.testing.assert_allclose(ratio.at(q, qd, a, b, radius, ("hand", "head")), expected, rtol=1e-6, atol=1e-9)
        met |= set(regions)
    assert met == {"hand", "head"}
    assert ratio.at(q, qd, a + 5, b + 5, radius, ("hand", "head")) == (0.0, 0.0, 0.0)
    assert ratio.at(q, qd, a, b, -radius, ("hand", "head")) == (0.0, 0.0, 0.0), "nobody"
    played = ratio.over(
        np.stack([q, q]),
        np.stack([qd, qd]),
        np.array([True, False]),
        *(np.stack([v] * 2) for v in (a, b, radius)),
        ("hand", "head"),
    )
    assert played[:, 0] == pytest.approx(expected) and not played[:, 1].any()
    assert set(REGIONS_OF) == set(REGIONS)
    assert {name for names in REGIONS_OF.values() for name in names} == {region.name for region in BODY_REGIONS}


def test_variants_lie_along_the_axis_of_safety_alone() -> None:
    params = with_variants(Params(), VARIANTS)
    assert params.safety.whole.shape == (len(VARIANTS),) and jnp.ndim(params.potential.k_att) == 0
    axes = batch_axes(params)
    found = jax.vmap(lambda p: p.safety.watched + p.potential.k_att, in_axes=(axes,))(params)
    assert found.shape == (len(VARIANTS),) and found[0] != found[1]
    with pytest.raises(TypeError, match="accepted: a cell with this monitor"):
        with_variants(eqx.tree_at(lambda p: p.safety, Params(), 1.0), VARIANTS)


# the field of exact shapes, and chance


def test_the_field_reads_the_nearest_shapes_in_other_directions() -> None:
    layout = GridLayout((-1.0, -1.0, -1.0), (9, 9, 9), 0.25)
    static = fit_grid(layout, jnp.full((9, 9, 9), 2.0))
    ends = jnp.asarray([[0.5, 0, 0], [0.6, 0.1, 0], [0, 0.7, 0], [0, 0, 9.0]])
    fields = Fields(static, Shapes(ends, ends, jnp.asarray([0.1, 0.1, 0.1, -1.0])))
    found = EXACT_FIELD.read(numbers(Margin(noise=0.02)), fields, jnp.zeros(3))
    np.testing.assert_allclose(found.person_distance, [0.38, 0.58, 10.0], atol=1e-12)
    np.testing.assert_allclose(found.person_gradient, [[-1, 0, 0], [0, -1, 0], [0, 0, 0]], atol=1e-12)
    np.testing.assert_allclose(found.distance, 0.38)
    np.testing.assert_allclose(found.standing_distance, 2.0, atol=1e-9)


def test_images_that_are_late_or_missing() -> None:
    t = 0.01 * np.arange(30)
    exposed = np.array([-0.05, 0.0, 0.05, 0.1])
    due = exposed + 0.03
    arrives = np.array([-0.02, np.inf, 0.25, 0.13])
    image, age, guarded = images_in_use(t, exposed, arrives, due)
    assert list(np.unique(image)) == [0, 3] and np.all(image[:13] == 0) and np.all(image[13:] == 3)
    np.testing.assert_allclose(age, t - exposed[image])
    assert list(np.flatnonzero(guarded)) == list(range(3, 13)), "from when the missing image was due"
    assert np.isinf(images_in_use(t, exposed, arrives + 1, due)[1]).all()


def test_chance_is_the_seed_alone() -> None:
    drawer = Drawer(robotica(), ("pass_by", "stand_and_work"), 100, 0.008)
    one, again, other = drawer(3), drawer(3), drawer(4)
    for name in ("a", "age", "noise", "image"):
        assert np.array_equal(getattr(one, name), getattr(again, name))
    assert not np.array_equal(one.noise, other.noise)
    assert one.a.shape == (one.noise.shape[0], 14, 3) and one.fastest < 5
    points = np.array([[[1.0, 0, 0]], [[3.0, 0, 0]]])
    np.testing.assert_allclose(moved(points, np.pi / 2, np.array([0, 0, 1.0]))[0, 0], [0, 1, 1], atol=1e-12)
    np.testing.assert_allclose(played_at(points, np.array([-1, 0.5 / 30, 9]))[:, 0, 0], [1, 2, 3])


def test_upper_limits() -> None:
    for count in (10, 2000, 20000):
        assert upper_limit(0, count) == pytest.approx(1 - 0.05 ** (1 / count), rel=1e-9)
    assert upper_limit(0, 20000) == pytest.approx(3 / 20000, rel=0.01)
    assert upper_limit(2, 100) == pytest.approx(0.0616, abs=1e-4)  # Clopper and Pearson's tables
    assert upper_limit(5, 5) == 1


# the path


def test_distance_from_a_line_and_motion_of_a_clock() -> None:
    line = np.stack([np.linspace(0, 1, 5), np.zeros(5)], axis=1)
    np.testing.assert_allclose(from_curve(np.array([[0.3, 0.2], [-0.3, 0.4], [0.6, 0]]), line), [0.2, 0.5, 0])
    dt = 0.01
    t = dt * np.arange(300)
    way = np.where(t < 1, 0.5 * t**3 / 3, 1 / 6 + 0.5 * (t - 1))  # jerk 1 until 1 s, then constant speed
    acceleration, jerk = clock_motion(way, dt)
    assert acceleration.max() == pytest.approx(1.0, abs=0.02) and jerk.max() == pytest.approx(1.0, abs=0.02)


# rows


def made(zone=None, excess: float = -0.1, short: float = -0.2, **other) -> dict:
    """A case of 100 ticks at 0.01 s: six variants that go 1 m, the first at half the speed from tick 20 on, while yellow."""
    count, kinds = 400, len(VARIANTS)
    way = np.minimum(0.01 * np.arange(count), 1.0)
    slow = np.minimum(np.where(np.arange(count) < 20, way, 0.2 + 0.005 * (np.arange(count) - 20)), 1.0)
    zones = np.where((np.arange(count) >= 20) & (np.arange(count) < 180), 1, 0) if zone is None else zone
    time = np.full(kinds, 1.0)
    time[0] = 1.8
    return {
        "person": np.array("reach_in"), "scene": np.array("robotica"), "seed": np.array(0), "clean": np.array(True),
        "travelled": np.stack([slow] + [way] * (kinds - 1)), "time_to_goal": time, "success": np.ones(kinds),
        "zone": np.stack([zones] * kinds), "counts": np.ones((kinds, count), bool), "hit": np.zeros(kinds, bool),
        "excess": np.full((kinds, count), excess), "excess_now": np.full((kinds, count), excess), "excess_pose": np.full((kinds, count), excess),
        "short": np.full((kinds, count), short), "separation": np.full((kinds, count), 0.5),
        "score_overall": np.array([76.0, 80, 80, 80, 80, 80]), "score_sound": np.array([60.0, 80, 80, 80, 80, 80]),
        "time_below_sp": np.zeros(kinds), "contact_ratio": np.zeros((kinds, count)), "contact_ratio_any": np.zeros((kinds, count)),
        "contact_ratio_rule": np.zeros((kinds, count)), **other,
    }  # fmt: skip


def test_lost_time_adds_up() -> None:
    lost, free = lost_by_zone(made(), 0, 1, 0.01)
    assert free == pytest.approx(1.0) and lost.sum() == pytest.approx(0.8) and lost[1] == pytest.approx(0.8)
    assert np.allclose(lost_by_zone(made(), 1, 1, 0.01)[0], 0)


def cases_of(*of: dict) -> dict:
    return {f"episode/{mode}/robotica-{k}-x": case for mode in ("both", "path") for k, case in enumerate(of)}


def test_rows_of_episodes() -> None:
    found = rows.all_rows(cases_of(made(), made(excess=0.006)), 0.01, 1.0, 10.0)
    value = {name: entry["value"] for name, entry in found.items()}
    assert (
        value["violations"] == 2 and value["excess_speed_max"] == 0.006 and value["relative_score"] == pytest.approx(95)
    )
    assert value["relative_sound"] == 75 and value["productivity_lost"] == pytest.approx(80)
    assert (
        value["lost_yellow"] == pytest.approx(0.8)
        and value["lost_red"] == 0
        and value["productivity_lost_tool"] == pytest.approx(0)
    )
    assert rows.holds("violations", 2) is False and rows.holds("relative_score", 95.1) is True
    assert rows.holds("time_mean", 1) is None and rows.bar("time_mean") == "" != rows.bar("violations")
    assert all(rows.definition(name) for name in found), [name for name in found if not rows.definition(name)]
    assert rows.all_rows(cases_of(made(short=0.002)), 0.01, 1.0, 10.0)["violations"]["value"] == 2
    fast = np.zeros((len(VARIANTS), 400))
    fast[-1, 7] = 1.2
    over = rows.all_rows(cases_of(made(contact_ratio=fast)), 0.01, 1.0, 10.0)
    assert over["pfl_over_max_pfl_reflected"]["value"] == 1.2 and over["pfl_over_max_pfl"]["value"] == 0
    assert rows.holds("pfl_over_max_pfl_reflected", 1.2) is False and rows.holds("pfl_over_max_pfl", 1.0) is True


def test_chatter_is_to_and_fro_within_half_a_second() -> None:
    zone = np.zeros(400, int)
    zone[100:110] = 3
    zone[200:300] = 3
    zone[300:] = 1
    one = made(zone=zone)
    glitch = made(zone=zone, clean=np.array(False))
    found = rows.zone_rows({"episode/both/a": one, "episode/both/b": glitch}, 0.01)
    assert found["stops"]["value"] == 2 and found["chatter"]["value"] == pytest.approx(1 / (4 / 60))
    assert found["zone_changes"]["value"] == pytest.approx(4 / (4 / 60))
    assert found["glitch_episodes"]["value"] == 1 and found["glitch_stops"]["value"] == 2


def test_rows_of_chance() -> None:
    part = {
        "excess": np.array([-0.1, 0.01, -0.2]), "short": np.array([-0.1, -0.1, 0.01]), "worst_zone": np.array([0, 3, 3]), "excess_now": np.array([-0.1, 0.02, 0.01]), "excess_pose": np.array([-0.1, 0.006, -0.2]),
        "hit": np.zeros(3, bool), "fastest": np.array([1.0, 2.5, 1.0]), "arrived": np.ones(3, bool),
        "met": np.ones(3, bool), "held": np.zeros(3, bool), "seconds": np.array(2.0),
    }  # fmt: skip
    found = rows.all_rows({"chance/a": part, "chance/b": part, "still/a": part}, 0.01, 1.0, 10.0)
    value = {name: entry["value"] for name, entry in found.items()}
    assert (
        value["chance_episodes"] == 6
        and value["chance_violations"] == 4 == value["chance_violations_now"]
        and value["chance_violations_pose"] == 2
        and value["chance_speed_in_stop"] == 2
    )
    assert value["chance_per_s"] == 1.5 and value["chance_upper"] == upper_limit(4, 6)
    assert value["no_retreat_violations"] == 2 and all(rows.definition(name) for name in found)


# the command line, the page, a run


def test_options(capsys: pytest.CaptureFixture[str]) -> None:
    quick = parse(["--quick"])
    assert quick.episodes == 128 and "path" not in quick.parts and len(quick.scenes) == 1
    assert command(SafetyConfig()).startswith("python -m experiments.safety --json")
    assert "--episodes 5 " in command(SafetyConfig(episodes=5))
    with pytest.raises(SystemExit):
        parse(["--help"])
    assert "stop before contact" in capsys.readouterr().out
    assert parse(["--config", "full"]).episodes == 20000
    for wrong in (["--parts", "none"], ["--people", "nobody_known"], ["--episodes", "0"], ["--recordings", "none"]):
        with pytest.raises(UsageError):
            run(parse(wrong))


def test_a_run_of_random_states_with_its_page(tmp_path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["--parts", "stop", "--states", "300", "--out", str(tmp_path / "run"), "--page", str(tmp_path / "p.md")]
    assert run(parse([*words, "--json", str(tmp_path / "r.json")])) == 0
    first = (tmp_path / "r.json").read_text()
    assert '"stop_margin_min"' in first and "0 bars do not hold" in capsys.readouterr().out
    text = (tmp_path / "p.md").read_text()
    assert "stop_margin_min_no_reaction" in text and "| face | 65 | 65 | 75 | 4.4 |" in text
    assert run(parse([*words, "--json", str(tmp_path / "r.json")])) == 0
    assert (tmp_path / "r.json").read_text() == first, "resumed"
    more = [
        "--parts",
        "stop",
        "chance",
        "--states",
        "300",
        "--episodes",
        "64",
        "--out",
        str(tmp_path / "run"),
        "--finished",
    ]
    assert run(parse([*more, "--no-figures", "--page", str(tmp_path / "p.md")])) == 0
    assert "1 of 4 parts are finished" in (tmp_path / "p.md").read_text()
    assert page({}, SafetyConfig(), ("reach_in",), (), SafetyParams())
