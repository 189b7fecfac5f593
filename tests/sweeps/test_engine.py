"""One compiled program, chunks, resuming, and what is not finite."""

import io
import time
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import toy_cell
from hypothesis import given, settings
from hypothesis import strategies as st

from hrcjax.lab.errors import StorageError, UsageError
from hrcjax.lab.parameters import set_leaves
from hrcjax.sweeps.engine import chunk_size, chunk_slices, flag_not_finite, run_sweep
from hrcjax.sweeps.settings import Settings, make_settings
from hrcjax.sweeps.store import RunStore, open_store
from hrcjax.sweeps.sweepable import Metric, Sweepable, Trace


def problem(scenes: tuple[str, ...] = ("robotica",), seeds: tuple[int, ...] = (0,), **changes: object) -> Sweepable:
    base = toy_cell.build_problem(scenes, ("reach_in",), seeds, "folded")
    return Sweepable(**{**vars(base), **changes})  # pyright: ignore[reportArgumentType]


def grid(counts: tuple[int, int] = (5, 2)) -> Settings:
    axes = [f"k_att=log:0.01:0.1:{counts[0]}", f"zeta=lin:2:4:{counts[1]}"]
    return make_settings(axes, toy_cell.ToyParams(), aliases={"k_att": "potential.k_att"})


def gathered(store: RunStore, name: str, chunks: int, world: int = 0) -> np.ndarray:
    parts = [store.read(f"world-{world:03d}-chunk-{c:05d}") for c in range(chunks)]
    return np.concatenate([part[name] for part in parts if part is not None])


@settings(deadline=None, max_examples=30)
@given(st.integers(1, 5000), st.floats(0.1, 100), st.integers(1, 100_000))
def test_chunks_fit_the_memory_and_hold_everything_once(count: int, memory: float, each: int) -> None:
    size = chunk_size(count, memory, each)
    assert 1 <= size <= count and size * each <= memory * 1e6
    slices = chunk_slices(count, size)
    assert [i for place in slices for i in range(place.start, place.stop)] == list(range(count))
    assert len(slices) <= -(-count // int(memory * 1e6 // each))  # no more chunks than the memory asks for


def test_memory_for_less_than_one_setting_is_refused() -> None:
    with pytest.raises(UsageError, match=r"one setting needs about 2\.5 MB"):
        chunk_size(10, 2.4, 2_500_000)


def test_one_trace_for_all_settings_and_worlds(tmp_path: Path) -> None:
    toy_cell.TRACES.clear()
    with open_store(tmp_path, "f", {"identity": {}}) as store:
        tally = run_sweep(problem(("robotica", "hri"), (0, 1)), grid(), store, 3, stream=io.StringIO())
    assert len(toy_cell.TRACES) == 1
    assert (tally.computed, tally.resumed) == (40, 0)
    assert tally.statuses == {0: 40}


@pytest.mark.parametrize(("memory", "said"), [(1000.0, False), (1e-3, True)])
def test_what_a_chunk_takes_is_said_and_whether_that_is_too_much(tmp_path: Path, memory: float, said: bool) -> None:
    printed, begin = io.StringIO(), time.monotonic()
    with open_store(tmp_path, "f", {"identity": {}}) as store:
        tally = run_sweep(problem(), grid(), store, 10, memory, stream=printed)
    assert "; a chunk takes 0 MB" in printed.getvalue()
    assert (f"more than the {memory:g} MB of --memory" in printed.getvalue()) == said
    elapsed = time.monotonic() - begin
    assert 0 < tally.compile_seconds < elapsed and 0 < tally.compute_seconds < elapsed - tally.compile_seconds


def test_results_are_those_of_each_setting_alone(tmp_path: Path) -> None:
    cell, sweep = problem(), grid((5, 2))
    with open_store(tmp_path, "f", {"identity": {}}) as store:
        run_sweep(cell, sweep, store, 3, stream=io.StringIO())
        score = gathered(store, "score", 4)
    world = cell.worlds[0][1]()
    for n in range(10):
        values = {name: np.asarray(column[n : n + 1], np.float32) for name, column in sweep.values.items()}
        params = jax.tree.map(lambda x: jnp.asarray(x, jnp.float32), set_leaves(cell.params, values))
        np.testing.assert_allclose(cell.evaluate(params, world)["score"][0], score[n], rtol=1e-5)


def test_only_what_is_missing_is_computed_and_gives_the_same_numbers(tmp_path: Path) -> None:
    cell = problem(("robotica", "hri"))
    with open_store(tmp_path, "f", {"identity": {}}) as store:
        run_sweep(cell, grid(), store, 3, stream=io.StringIO())
        before = [gathered(store, "tool", 4, world) for world in (0, 1)]
        (tmp_path / "chunks" / "world-001-chunk-00002.h5").unlink()
        (tmp_path / "chunks" / "world-001-chunk-00003.h5").write_bytes(b"damaged")
        toy_cell.BUILT.clear()
        tally = run_sweep(cell, grid(), store, 3, stream=io.StringIO())
        assert (tally.computed, tally.resumed) == (4, 16)
        assert tally.statuses == {0: 20}
        assert toy_cell.BUILT == [("hri", "reach_in", 0)]
        for world in (0, 1):
            np.testing.assert_array_equal(gathered(store, "tool", 4, world), before[world])
        toy_cell.BUILT.clear()
        assert run_sweep(cell, grid(), store, 3, stream=io.StringIO()).computed == 0
        assert toy_cell.BUILT == []
        (tmp_path / "chunks" / "world-000-about.h5").unlink()
        assert run_sweep(cell, grid(), store, 3, stream=io.StringIO()).computed == 0
        assert store.read("world-000-about") is not None


def test_settings_that_are_not_finite_are_flagged_and_counted(tmp_path: Path) -> None:
    def evaluate(params: toy_cell.ToyParams, world: object) -> dict[str, jax.Array]:
        out = toy_cell.evaluate(params, world)  # pyright: ignore[reportArgumentType]
        att = params.potential.k_att
        broken = jnp.where(att > 0.09, jnp.nan, out["score"])
        out["separation"] = jnp.full_like(out["separation"], jnp.inf)
        return {**out, "score": broken}

    with open_store(tmp_path, "f", {"identity": {}}) as store:
        cell = problem(evaluate=evaluate, open_ended=frozenset({"separation"}))
        tally = run_sweep(cell, grid(), store, 4, stream=io.StringIO())
        assert tally.not_finite == 2
        assert gathered(store, "status", 3).tolist() == [0] * 8 + [-1, -1]
        assert run_sweep(cell, grid(), store, 4, stream=io.StringIO()).not_finite == 2


def test_flag_looks_into_traces_and_keeps_the_programs_own_status() -> None:
    tool = np.zeros((4, 2, 3), np.float32)
    tool[1, 1, 2] = np.inf
    outcome = {"score": np.array([0, 0, 0, np.nan]), "tool": tool, "zone": np.ones(4, np.int8)}
    assert flag_not_finite(outcome).tolist() == [0, -1, 0, -1]
    assert flag_not_finite({**outcome, "status": np.array([2, 2, 3, 0])}).tolist() == [2, -1, 3, -1]
    assert flag_not_finite(outcome, frozenset({"tool"})).tolist() == [0, 0, 0, -1]


def test_announcements_are_checked(tmp_path: Path) -> None:
    base = problem()
    faults = {
        "lacks \\['nice'\\]": {"metrics": {**base.metrics, "nice": Metric("1", "low", "")}},
        "undeclared \\['tool'\\]": {"traces": {n: t for n, t in base.traces.items() if n != "tool"}},
        "returns tool of shape": {"traces": {**base.traces, "tool": Trace(("time",), "m", "")}},
    }
    for n, (message, change) in enumerate(faults.items()):
        with open_store(tmp_path / str(n), "f", {"identity": {}}) as store, pytest.raises(ValueError, match=message):
            run_sweep(problem(**change), grid(), store, 4, stream=io.StringIO())
    with pytest.raises(ValueError, match="rank 'beauty' is no metric"):
        problem(rank="beauty")
    with pytest.raises(ValueError, match="better is 'up'"):
        problem(metrics={"score": Metric("1", "up", "")})  # pyright: ignore[reportArgumentType]


def test_worlds_of_other_shapes_are_refused(tmp_path: Path) -> None:
    base = problem(("robotica", "hri"))
    (one, build), (two, _) = base.worlds
    wide = lambda: jax.tree.map(lambda x: jnp.stack([x, x]), build())  # noqa: E731
    with open_store(tmp_path, "f", {"identity": {}}) as store, pytest.raises(ValueError, match="worlds differ"):
        run_sweep(problem(worlds=[(one, build), (two, wide)], describe=None), grid(), store, 4, stream=io.StringIO())


def test_worlds_that_cannot_be_built_are_named(tmp_path: Path) -> None:
    def build() -> None:
        raise ValueError("a.bvh: line 3:\n no joints")

    labels = {"scene": "hri", "person": "a", "seed": 0}
    with (
        open_store(tmp_path, "f", {"identity": {}}) as store,
        pytest.raises(UsageError, match=r"scene hri, person a: a\.bvh: line 3: no joints"),
    ):
        run_sweep(problem(worlds=[(labels, build)]), grid(), store, 4, stream=io.StringIO())


def test_a_disk_that_is_too_small_is_seen_at_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import hrcjax.sweeps.engine as engine

    usage = type("Usage", (), {"free": 1000})()
    monkeypatch.setattr(engine.shutil, "disk_usage", lambda _: usage)
    with open_store(tmp_path, "f", {"identity": {}}) as store, pytest.raises(StorageError, match="are needed in"):
        run_sweep(problem(), grid(), store, 4, stream=io.StringIO())


def test_space_is_asked_for_what_is_still_to_do_and_the_results(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import hrcjax.sweeps.engine as engine

    with open_store(tmp_path, "f", {"identity": {}}) as store:
        run_sweep(problem(), grid(), store, 5, stream=io.StringIO())
        (tmp_path / "chunks" / "world-000-chunk-00001.h5").unlink()
        kept = store.read("world-000-chunk-00000")
        assert kept is not None
        each = sum(array[0].nbytes for array in kept.values())
        usage = type("Usage", (), {"free": (5 + 10) * each - 1})  # five settings to do, ten in the results
        monkeypatch.setattr(engine.shutil, "disk_usage", lambda _: usage)
        with pytest.raises(StorageError, match="are needed in"):
            run_sweep(problem(), grid(), store, 5, stream=io.StringIO())
        usage.free += 1
        assert run_sweep(problem(), grid(), store, 5, stream=io.StringIO()).computed == 5


def test_every_world_is_described_under_its_own_name(tmp_path: Path) -> None:
    cell = problem(("robotica", "hri"))
    assert cell.describe is not None
    with open_store(tmp_path, "f", {"identity": {}}) as store:
        run_sweep(cell, grid(), store, 10, stream=io.StringIO())
        for w, (_, build) in enumerate(cell.worlds):
            kept = store.read(f"world-{w:03d}-about")
            assert kept is not None
            for name, array in cell.describe(build()).items():
                np.testing.assert_array_equal(kept[name], array)
        assert kept["goal"].tolist() != cell.describe(cell.worlds[0][1]())["goal"].tolist()
