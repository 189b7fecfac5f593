"""Programs kept between runs: the same numbers, no second trace, and never another program's."""

from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from hrcjax.lab.traced import traced


@pytest.fixture
def cache(tmp_path: Path):
    before = jax.config.jax_compilation_cache_dir
    jax.config.update("jax_compilation_cache_dir", str(tmp_path))
    yield tmp_path / "traced"
    jax.config.update("jax_compilation_cache_dir", before)


def program(counts: list[int], factor: float = 2.0):
    def evaluate(params, world):
        counts.append(1)
        return {"double": factor * params["a"], "sum": params["a"] + world}

    return evaluate


def run(evaluate, args, identity):
    return traced(evaluate, args, identity).lower().compile()(*jax.tree.leaves(args))


def test_kept_program_is_read_back(cache: Path) -> None:
    args = ({"a": jnp.arange(3.0)}, jnp.asarray(4.0))
    counts: list[int] = []
    first = run(program(counts), args, "one")
    assert len(counts) == 1 and len(list(cache.iterdir())) == 1
    again = run(program(counts), args, "one")
    assert len(counts) == 1
    for name in ("double", "sum"):
        np.testing.assert_array_equal(first[name], again[name])
    np.testing.assert_array_equal(again["sum"], [4, 5, 6])


def test_what_differs_is_traced_again(cache: Path) -> None:
    args = ({"a": jnp.arange(3.0)}, jnp.asarray(4.0))
    counts: list[int] = []
    run(program(counts), args, "one")
    tripled = run(program(counts, 3.0), args, "another")["double"]
    run(program(counts), ({"a": jnp.arange(4.0)}, jnp.asarray(4.0)), "one")
    assert len(counts) == 3 and len(list(cache.iterdir())) == 3
    np.testing.assert_array_equal(tripled, [0, 3, 6])


def test_damaged_file_is_traced_anew(cache: Path) -> None:
    args = ({"a": jnp.arange(3.0)}, jnp.asarray(4.0))
    counts: list[int] = []
    run(program(counts), args, "one")
    (kept,) = cache.iterdir()
    kept.write_bytes(b"not a program")
    np.testing.assert_array_equal(run(program(counts), args, "one")["double"], [0, 2, 4])
    assert len(counts) == 2


@pytest.mark.parametrize("place", [3, -20])
def test_flipped_byte_is_traced_anew(cache: Path, place: int) -> None:
    args = ({"a": jnp.arange(3.0)}, jnp.asarray(4.0))
    counts: list[int] = []
    run(program(counts), args, "one")
    (kept,) = cache.iterdir()
    damaged = bytearray(kept.read_bytes())
    damaged[place] ^= 1
    kept.write_bytes(damaged)
    run(program(counts), args, "one")
    assert len(counts) == 2


def test_code_edited_since_the_start_keeps_nothing(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("hrcjax.lab.traced.code_digest", lambda: "edited")
    run(program([]), ({"a": jnp.arange(3.0)}, jnp.asarray(4.0)), "one")
    assert not cache.exists()


def test_without_identity_nothing_is_kept(cache: Path) -> None:
    counts: list[int] = []
    run(program(counts), ({"a": jnp.arange(3.0)}, jnp.asarray(4.0)), None)
    assert not cache.exists()
