"""All measures of a run whose answers are known: a straight minimum-jerk reach, then rest."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from hrcjax.metrics import METRICS, EpisodeMetrics, Run, ScoreParams, Yardstick, episode_metrics

DT, N = 0.02, 161
OF_RUN = {field.name for field in dataclasses.fields(Run)}


def arrays(dtype=jnp.float64, reach=0.5):
    """A reach of `reach` metres in 2 s, then 1.2 s of rest, in which everything is bad and must not count."""
    t = np.arange(N) * DT
    u = np.minimum(t / 2.0, 1.0)
    along = reach * (10 * u**3 - 15 * u**4 + 6 * u**5)
    rest = t > 2.01
    tool = np.array([0.1, 0.2, 0.3]) + along[:, None] * np.array([0.0, 0.6, 0.8])
    q = np.stack([along, -2 * along, 0 * along], axis=-1) + 100 * rest[:, None]
    qd = np.gradient(q, DT, axis=0) * ~rest[:, None]
    sep = np.where(rest, 0.05, 0.5)
    as_array = {
        "tool": tool, "q": q, "qd": qd, "qdd": np.gradient(qd, DT, axis=0), "tau": np.full((N, 3), 2.0),
        "separation": sep[::3], "closing_speed": np.full(54, 0.2), "obstacle_distances": np.full((54, 2), 0.4),
        "clearance": np.linspace(0.3, 0.1, 54), "goal": tool[-1],
    }  # fmt: skip
    zone = np.where(t < 0.5, 0, np.where(t < 1.0, 1, np.where(t < 1.3, 2, 3)))
    given = {k: jnp.asarray(v, dtype) for k, v in as_array.items()}
    return given | {"zone": jnp.asarray(zone, jnp.int32)}


def measure(run, **changes):
    settings = {
        "dt": DT, "protective_distance": 0.6, "tolerance": 1e-3, "ideal_time": 1.5, "plan_length": 0.55,
        "plan_bending_energy": 1.25, "unsafe_distance": 0.1, "slow": 0.02,
    }  # fmt: skip
    given = settings | run | changes
    of_run, other = ({k: v for k, v in given.items() if (k in OF_RUN) == which} for which in (True, False))
    return episode_metrics(Run(**of_run), Yardstick(**other))


# One compilation for all runs of one shape.
settled = jax.jit(measure)


def test_every_measure_is_described() -> None:
    fields = [f.name for f in dataclasses.fields(EpisodeMetrics)]
    assert list(METRICS) == fields
    for unit, better, meaning in METRICS.values():
        assert unit and better in ("low", "high") and len(meaning) > 10


def test_a_known_run(dtype: jnp.dtype) -> None:
    got = settled(arrays(dtype))
    assert all(x.dtype == dtype and x.shape == () for x in jax.tree.leaves(got))
    T = float(got.time_to_goal)
    assert 1.7 < T < 1.95 and got.success == 1 and got.goal_error < 1e-3
    np.testing.assert_allclose(got.tool_length, 0.5, atol=2e-3)
    np.testing.assert_allclose(got.tool_bending_energy, 0.0, atol=0.05 if dtype == jnp.float32 else 1e-4)
    np.testing.assert_allclose([got.plan_length, got.plan_bending_energy], [0.55, 1.25], rtol=1e-6)
    np.testing.assert_allclose([got.clearance, got.separation], [0.1, 0.05], rtol=1e-5)
    u = np.linspace(0, T / 2, 1000)
    jerk = 0.5 / 2**3 * (60 - 360 * u + 360 * u**2)
    np.testing.assert_allclose(got.jerk_rms, np.sqrt(np.mean(jerk**2)), rtol=0.05)
    expected = -np.log(np.mean(jerk**2) * T**4 / (1.875 * 0.25) ** 2)
    np.testing.assert_allclose(got.log_dimensionless_jerk, expected, atol=0.08)
    np.testing.assert_allclose(got.sparc, -1.41, atol=0.03)
    np.testing.assert_allclose([got.time_green, got.time_yellow, got.time_red], [0.5, 0.5, 0.3], atol=1e-5)
    np.testing.assert_allclose(got.time_stop, T - 1.3, atol=0.045)
    np.testing.assert_allclose(got.time_below_sp, T, atol=0.085)
    np.testing.assert_allclose(got.energy, 2 * 3 * 0.5, rtol=0.01)  # 2 N m times a travel of 3 x 0.5 rad
    np.testing.assert_allclose(got.score_safety, 0.4 * 100 + 0.3 * 100 + 0.3 * 50, rtol=1e-4)  # 0.5 m at 0.2 m/s: 2.5 s
    # Power: v_mean / v_peak = 1/1.875 over 2 s. Joints share 1 : 2 : 0, and the changes of qdd do.
    parts = 0.3 * 150 / T + 0.3 * 100 / 1.875 * 2 / T + 0.1 * (1 + 50.5 + 100) / 3 + 0.3 * 50
    np.testing.assert_allclose(got.score_efficiency, parts, rtol=0.02)
    np.testing.assert_allclose(got.score_overall, 0.8 * got.score_safety + 0.2 * got.score_efficiency, rtol=1e-5)


def test_what_follows_the_arrival_does_not_count() -> None:
    """Everything after the arrival replaced by noise: only the smallest distances may see it."""
    run, rng = arrays(), np.random.default_rng(0)
    after = {k: jnp.arange(v.shape[0]) * (N // v.shape[0]) > 110 for k, v in run.items() if k != "goal"}
    noisy = dict(run)
    for name in ("tool", "q", "qd", "qdd", "tau", "separation", "closing_speed", "obstacle_distances"):
        noise = jnp.asarray(rng.uniform(0, 9, run[name].shape))
        noisy[name] = jnp.where(after[name].reshape((-1,) + (1,) * (noise.ndim - 1)), noise, run[name])
    noisy["zone"] = jnp.where(after["zone"], 0, run["zone"])
    for (name, expected), got in zip(
        dataclasses.asdict(settled(run)).items(), jax.tree.leaves(settled(noisy)), strict=True
    ):
        if name not in ("separation", "clearance"):
            np.testing.assert_allclose(got, expected, rtol=1e-9, atol=1e-9, err_msg=name)


def test_normalisers_and_weights() -> None:
    run = arrays()
    base, other = settled(run), settled(run, largest_power=1e9, largest_joint_speed=1e9, largest_proximity=1e9)
    assert other.score_efficiency < base.score_efficiency - 20 and other.score_safety < base.score_safety - 29
    weighted = settled(run, score=ScoreParams(safety=1.0, efficiency=0.0, horizon=2.0))
    np.testing.assert_allclose(weighted.score_overall, weighted.score_safety)
    np.testing.assert_allclose(weighted.score_safety, 100.0)


def test_unsafe_distance_and_separation_distance_over_time() -> None:
    got = settled(arrays(), unsafe_distance=0.6, protective_distance=jnp.where(jnp.arange(54) < 10, 0.6, 0.1))
    np.testing.assert_allclose(got.score_safety, 0.3 * 100 + 0.3 * 50, rtol=1e-9)
    np.testing.assert_allclose(got.time_below_sp, 10 * 3 * DT, rtol=1e-9)


def test_a_run_that_does_not_arrive() -> None:
    got = settled(arrays(), goal=jnp.array([5.0, 5.0, 5.0]))
    assert got.success == 0 and got.goal_error > 5
    np.testing.assert_allclose(got.time_to_goal, (N - 1) * DT, rtol=1e-9)


def test_a_robot_at_rest_gives_finite_measures() -> None:
    run = arrays()
    still = {k: jnp.broadcast_to(run[k][:1], run[k].shape) for k in ("tool", "q", "qd", "qdd")}
    got = settled(run | still, goal=still["tool"][0])
    for name, value in dataclasses.asdict(got).items():
        assert jnp.isfinite(value), name


def test_stride_of_smoothness() -> None:
    """Half the rate, nearly the same smoothness."""
    base, half = settled(arrays()), jax.jit(lambda run: measure(run, smoothness_stride=2))(arrays())
    np.testing.assert_allclose(half.sparc, base.sparc, atol=0.02)
    np.testing.assert_allclose(half.jerk_rms, base.jerk_rms, rtol=0.1)
    assert half.jerk_rms != base.jerk_rms


def test_decimated_arrays_must_fit() -> None:
    run = arrays()
    short = {k: run[k][:53] for k in ("separation", "closing_speed", "obstacle_distances", "clearance")}
    settled(run | {k: run[k][:1].repeat(81, axis=0) for k in short})
    with pytest.raises(ValueError, match="53 samples are not every k-th of 161"):
        measure(run | short)


def test_vmap_is_a_loop() -> None:
    runs = [arrays(), arrays(reach=0.3)]
    both = jax.jit(jax.vmap(measure))(jax.tree.map(lambda *x: jnp.stack(x), *runs))
    for k, run in enumerate(runs):
        for got, expected in zip(jax.tree.leaves(both), jax.tree.leaves(settled(run)), strict=True):
            np.testing.assert_allclose(got[k], expected, rtol=1e-9, atol=1e-9)


def test_derivatives_are_finite() -> None:
    run = arrays()
    names = ("tool", "qd", "tau", "separation")

    def total(changed):
        return sum(jax.tree.leaves(measure(run | changed)))

    slopes = jax.jit(jax.grad(total))({k: run[k] for k in names})
    for name, slope in slopes.items():
        assert jnp.all(jnp.isfinite(slope)), name
        assert name == "separation" or jnp.any(slope != 0), name


def test_the_sound_score_of_a_known_run(dtype: jnp.dtype) -> None:
    """Straight way 0.5 m of a plan of 0.55; clearance 0.1 m; 0.5 m of a protective distance of 0.6 throughout."""
    got = settled(arrays(dtype))
    T = float(got.time_to_goal)
    terms = [100, 100 * (5 / 6) ** 2, 100 * 1.5 * 0.5 / 0.55 / T, got.sound_jerk, 100 * 30 / 33]
    names = ("sound_clearance", "sound_separation", "sound_time", "sound_jerk", "sound_energy")
    np.testing.assert_allclose([getattr(got, name) for name in names], terms, rtol=0.002)
    assert 95 < got.sound_jerk <= 100
    quality = np.dot([0.25, 0.25, 0.2, 0.15, 0.15], [getattr(got, name) for name in names])
    np.testing.assert_allclose(got.score_sound, 20 + 0.8 * quality, rtol=1e-5)


def test_what_fails_a_run() -> None:
    """Touching an obstacle at any time, or the person while the arm moves; a person who runs into an arm at rest does not."""
    run, late = arrays(), jnp.arange(54) == 50
    moving, resting = jnp.arange(54) == 15, late
    hit = jnp.asarray(-0.001)
    fine = settled(run).score_sound
    assert fine > 60
    for changed in (
        {"clearance": jnp.where(late, hit, run["clearance"])},
        {"separation": jnp.where(moving, hit, run["separation"])},
        {"goal": jnp.array([5.0, 5.0, 5.0])},
    ):
        assert settled(run | changed).score_sound < 10
    np.testing.assert_allclose(
        settled(run | {"separation": jnp.where(resting, hit, run["separation"])}).score_sound, fine
    )


def test_a_detour_costs_time_and_a_short_plan_gains_none() -> None:
    run = arrays()
    long, short, given = settled(run, plan_length=2.0), settled(run, plan_length=0.1), settled(run, straight_time=0.5)
    np.testing.assert_allclose(long.sound_time / settled(run).sound_time, 0.55 / 2.0, rtol=1e-9)
    np.testing.assert_allclose(short.sound_time, 150 / short.time_to_goal, rtol=1e-9)
    np.testing.assert_allclose(given.sound_time, 50 / given.time_to_goal, rtol=1e-9)


def test_more_power_is_not_better() -> None:
    """Twice the torque for the same motion: the paper's score stays, the sound one falls."""
    run = arrays()
    base, double = settled(run), settled(run | {"tau": 2 * run["tau"]})
    np.testing.assert_allclose(double.score_overall, base.score_overall, rtol=1e-9)
    assert double.score_sound < base.score_sound - 0.5
