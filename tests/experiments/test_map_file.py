"""A map that is written is the one that is read; what is not a whole map of this version is refused in one line."""

import json

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from experiments.errors import UsageError
from experiments.map_file import HEADER, open_map, save_map
from hrcjax.map import MapLayout, MapParams, empty_map

LAYOUT = MapLayout(lower=(-0.5, 0.25, 1.0), shape=(6, 5, 4), spacing=0.05, capacity=32, seen=32, born=16, refitted=8)
PARAMS = MapParams(far=7.5, patience=3.0)


@pytest.fixture
def state():
    """Random numbers in every array, each within its meaning."""
    random = np.random.default_rng(3)

    def fill(leaf):
        if leaf.dtype.kind == "f":
            return jnp.asarray(random.normal(size=leaf.shape), leaf.dtype)
        return jnp.asarray(random.integers(0, 2, leaf.shape), leaf.dtype)

    return jax.tree.map(fill, empty_map(LAYOUT))


def test_what_is_opened_is_what_was_saved(tmp_path, state) -> None:
    path = tmp_path / "a map"
    save_map(path, LAYOUT, PARAMS, state)
    layout, params, again = open_map(path)
    assert layout == LAYOUT and params == PARAMS
    assert jax.tree.structure(again) == jax.tree.structure(state)
    for a, b in zip(jax.tree.leaves(again), jax.tree.leaves(state), strict=True):
        assert a.dtype == b.dtype
        np.testing.assert_array_equal(a, b)
    assert [p.name for p in tmp_path.iterdir()] == ["a map"]


def _refusal(path) -> str:
    with pytest.raises(UsageError) as error:
        open_map(path)
    message = str(error.value)
    assert "\n" not in message and "accepted" in message and str(path) in message
    return message


def _change(path, **changes) -> None:
    with np.load(path) as file:
        arrays = {name: file[name] for name in file.files}
    for name, value in changes.items():
        name = name.replace("__", ".")
        arrays.pop(name)
        if value is not None:
            arrays[name] = value
    with open(path, "wb") as file:
        np.savez(file, **arrays)


def _header(path) -> dict:
    with np.load(path) as file:
        return json.loads(str(file[HEADER][()]))


def test_foreign_files_are_refused(tmp_path) -> None:
    assert "no map at" in _refusal(tmp_path / "absent.npz")
    (tmp_path / "text.npz").write_text("not a map")
    assert "holds no map" in _refusal(tmp_path / "text.npz")
    np.savez(tmp_path / "points.npz", points=np.zeros((3, 3)))
    assert "holds no map" in _refusal(tmp_path / "points.npz")
    assert "holds no map" in _refusal(tmp_path)


def test_another_version_is_refused(tmp_path, state) -> None:
    path = tmp_path / "map.npz"
    save_map(path, LAYOUT, PARAMS, state)
    _change(path, header=np.array(json.dumps({**_header(path), "version": 99})))
    assert "version 99" in _refusal(path)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"label": None}, "label is missing"),
        ({"label": np.zeros((31, 64), np.int8)}, "label is int8 (31, 64)"),
        ({"label": np.zeros((32, 64), np.int32)}, "label is int32"),
        ({"drift": np.full(32, np.nan, np.float32)}, "drift is not finite"),
        ({"levels__0__slot": np.full((14, 13, 12), 33, np.int32)}, "outside of the 32 blocks"),
    ],
)
def test_arrays_that_are_no_map_are_refused(tmp_path, state, change, said) -> None:
    path = tmp_path / "map.npz"
    save_map(path, LAYOUT, PARAMS, state)
    _change(path, **change)
    assert said in _refusal(path)


def test_headers_that_make_no_layout_are_refused(tmp_path, state) -> None:
    path = tmp_path / "map.npz"
    for part in ({"layout": {"levels": 1}}, {"layout": {"size": 1}}, {"params": {"far": "x"}}, {"params": 3}):
        save_map(path, LAYOUT, PARAMS, state)
        _change(path, header=np.array(json.dumps({**_header(path), **part})))
        assert "damaged" in _refusal(path)


def test_a_file_with_a_hole_is_refused(tmp_path, state) -> None:
    path = tmp_path / "map.npz"
    save_map(path, LAYOUT, PARAMS, state)
    whole = bytearray(path.read_bytes())
    for at in (len(whole) // 3, len(whole) // 2):
        torn = bytearray(whole)
        torn[at : at + 64] = bytes(64)
        path.write_bytes(torn)
        assert "damaged" in _refusal(path)
    path.write_bytes(whole[: len(whole) // 2])
    _refusal(path)
