"""A map that is written is the one that is read; what is not a whole map of this version is refused in one line."""

import json

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from hrcjax.io.map_file import HEADER, _leaves, open_map, save_map
from hrcjax.lab.errors import UsageError
from hrcjax.map import MapLayout, MapParams, View, empty_map, fuse
from hrcjax.sense import d435i

LAYOUT = MapLayout(lower=(-0.5, 0.25, 1.0), shape=(6, 5, 4), spacing=0.05, capacity=32, seen=32, born=16, refitted=8)
PARAMS = MapParams(far=7.5, patience=3.0)


@pytest.fixture(scope="module")
def state():
    """A board seen from above in two frames, the second one without a part of it."""
    x, y = np.meshgrid(np.arange(-0.4, 0.4, 0.03), np.arange(0.3, 1.1, 0.03))
    points = np.stack([x.ravel(), y.ravel(), 1.21 + 0.1 * x.ravel()], axis=1)
    eye = jnp.asarray([0.0, 0.7, 2.2], jnp.float32)
    camera = d435i(eye, jnp.asarray([0.0, 0.71, 1.2], jnp.float32), 8)
    count = len(points)

    @jax.jit
    def step(state, mask):
        variance = jnp.full(count, 1e-6, jnp.float32)
        view = View(jnp.asarray(points, jnp.float32), mask, variance, jnp.zeros((15, 20), jnp.float32))
        return fuse(LAYOUT, PARAMS, state, camera, view)[0]

    state = empty_map(LAYOUT)
    for mask in (points[:, 0] < 0.2, points[:, 0] > -0.3):
        state = step(state, jnp.asarray(mask))
    return state


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
        ({"levels__0__rows": np.zeros((32, 4, 64), np.int32)}, "rows is int32"),
    ],
)
def test_arrays_that_are_no_map_are_refused(tmp_path, state, change, said) -> None:
    path = tmp_path / "map.npz"
    save_map(path, LAYOUT, PARAMS, state)
    _change(path, **change)
    assert said in _refusal(path)


def _first(level) -> tuple[int, tuple[int, ...]]:
    """A slot of a level that holds points, and its place."""
    used = int(np.flatnonzero((np.asarray(level.rows)[:, 3] > 0).any(axis=1))[1])
    return used, tuple(int(v) for v in np.asarray(level.place)[used])


def _put(name: str, at, value):
    """(arrays) -> the array with a value in one place."""

    def change(state, level):
        used, place = _first(level)
        array = np.array(_leaves(state)[name])
        array[at(used, place) if callable(at) else at] = value(used) if callable(value) else value
        return array

    return name, change


def _box(used: int, place: tuple[int, ...]) -> tuple[int, ...]:
    """Where the index keeps the box of a place."""
    x, y, z = place
    return x // 2, y // 2, z // 2, 4 * (x % 2) + 2 * (y % 2) + z % 2


DAMAGES = {
    "a slot that is another's": (
        *_put("levels.0.slot", lambda s, p: p, lambda s: s - 1),
        "slot and place are inconsistent",
    ),
    "a block nowhere": (*_put("levels.0.slot", lambda s, p: p, 32), "slot and place are inconsistent"),
    "a slot of a free place": (*_put("levels.1.slot", (0, 0, 0), 0), "slot and place are inconsistent"),
    "a place outside": (*_put("levels.0.place", lambda s, p: (s, 0), 3), "outside of the box"),
    "a place far outside": (*_put("levels.0.place", lambda s, p: s, 999), "outside of the box"),
    "a negative place": (*_put("levels.0.place", lambda s, p: (s, 2), -5), "outside of the box"),
    "a negative weight": (*_put("levels.0.rows", lambda s, p: (s, 3, 0), -0.1), "negative weight"),
    "a weight of nothing": (*_put("levels.1.rows", lambda s, p: (s, 3, 0), np.nan), "not finite"),
    "a coordinate of nothing": (*_put("levels.0.rows", lambda s, p: (s, 1, 0), np.inf), "not finite"),
    "points in a free slot": (*_put("levels.0.rows", (31, 3, 0), 0.2), "free slot"),
    "another box": (*_put("levels.0.index.octets", _box, 0), "box that is not the bounding box"),
    "no box": (*_put("levels.0.index.octets", _box, -1), "which blocks hold points"),
    "a box of no block": (*_put("levels.1.index.octets", (0, 0, 0, 0), 5), "which blocks hold points"),
    "another slot of a box": (
        *_put("levels.0.index.octets", lambda s, p: (*_box(s, p)[:3], _box(s, p)[3] + 8), 31),
        "index and slot are inconsistent",
    ),
    "a slot without a box": (*_put("levels.1.index.octets", (0, 0, 0, 8), 0), "index and slot are inconsistent"),
    "another hull": (*_put("levels.0.index.hull", lambda s, p: _box(s, p)[:3], 0), "hull that is not the bounding box"),
    "a turn too far": (*_put("turn", (), 99), "turn holds 99"),
    "a turn before the first": (*_put("turn", (), -1), "turn holds -1"),
    "a label of nothing": (*_put("label", (0, 0), 4), "label holds 4"),
    "a negative count": (*_put("missed", (0, 0), -1), "missed holds -1"),
    "negative information": (*_put("information", (0, 0), -1.0), "information holds -1"),
}


@pytest.mark.parametrize(("name", "change", "said"), DAMAGES.values(), ids=DAMAGES.keys())
def test_a_map_whose_arrays_do_not_belong_together_is_refused(tmp_path, state, name, change, said) -> None:
    path = tmp_path / "map.npz"
    save_map(path, LAYOUT, PARAMS, state)
    level = state.levels[int(name[7])] if name.startswith("levels") else state.levels[0]
    _change(path, **{name: change(state, level)})
    assert said in _refusal(path)


def _header_with(path, part: str, **values) -> None:
    header = _header(path)
    target = header[part] if part else header
    for key, value in values.items():
        if value is None:
            del target[key]
        else:
            target[key] = value
    _change(path, header=np.array(json.dumps(header)))


@pytest.mark.parametrize(
    ("part", "values", "said"),
    [
        ("", {"layout": 3}, "layout is missing"),
        ("", {"params": None}, "params is missing"),
        ("", {"more": 1}, "more is not known"),
        ("layout", {"size": 1}, "size is not known"),
        ("layout", {"born": None}, "born is missing"),
        ("layout", {"levels": 1}, "at least 2 levels"),
        ("layout", {"levels": 2.5}, "layout.levels 2.5 is not an integer"),
        ("layout", {"levels": 2}, "levels.2.index.hull is not known"),
        ("layout", {"shape": [6, 5]}, "not three numbers"),
        ("layout", {"shape": [6, 5, -4]}, "sizes of at least 1"),
        ("layout", {"lower": [0, 0, float("nan")]}, "layout.lower nan"),
        ("layout", {"lower": [0, 0, "0"]}, "layout.lower '0'"),
        ("layout", {"lower": [-0.45, 0.25, 1.0]}, "box that is not the bounding box"),
        ("layout", {"spacing": 0}, "spacing 0 is not above 0"),
        ("layout", {"spacing": float("inf")}, "layout.spacing inf"),
        ("layout", {"capacity": 10**9}, "more than the blocks of the box"),
        ("layout", {"seen": True}, "layout.seen True"),
        ("params", {"far": "x"}, "params.far 'x'"),
        ("params", {"far": float("nan")}, "params.far nan"),
        ("params", {"ratio": 0}, "params.ratio 0 is out of range"),
        ("params", {"noise": -1}, "params.noise -1 is out of range"),
        ("params", {"speed": 1}, "speed is not known"),
        ("params", {"drift": None}, "drift is missing"),
    ],
)
def test_headers_that_make_no_map_are_refused(tmp_path, state, part, values, said) -> None:
    path = tmp_path / "map.npz"
    save_map(path, LAYOUT, PARAMS, state)
    _header_with(path, part, **values)
    message = _refusal(path)
    assert said in message and "damaged" in message


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
