"""Axes from text, products and samples."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from toy_cell import ToyParams

from hrcjax.lab.errors import UsageError
from hrcjax.lab.parameters import leaf_names
from hrcjax.sweeps.settings import check_domain, make_settings, parse_axis, quick_axes, short_labels

NAMES = leaf_names(ToyParams())
ALIASES = {"k_att": "potential.k_att", "K_rep": "potential.k_rep"}


def test_lin_axis() -> None:
    axis = parse_axis("potential.zeta=lin:1.5:5:8", NAMES, {})
    assert (axis.name, axis.scale, axis.low, axis.high) == ("potential.zeta", "lin", 1.5, 5.0)
    np.testing.assert_allclose(axis.values, [1.5, 2, 2.5, 3, 3.5, 4, 4.5, 5])


def test_log_axis() -> None:
    axis = parse_axis("k_att=log:0.001:1:4", NAMES, ALIASES)
    assert axis.name == "potential.k_att"
    np.testing.assert_allclose(axis.values, [0.001, 0.01, 0.1, 1])


def test_a_range_of_one_value() -> None:
    assert parse_axis("zeta=lin:2:2:1", NAMES, {}).values == (2,)


def test_list_axis_keeps_its_order() -> None:
    axis = parse_axis("collision.k_rep = 0.8, 0.4", NAMES, {})
    assert (axis.scale, axis.values, axis.low, axis.high) == ("list", (0.8, 0.4), 0.4, 0.8)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("k_att", "is not an axis; write NAME=lin"),
        ("=1", "is not an axis"),
        ("k_att=", "is not an axis"),
        ("k_att=cubic:1:2:3", "is not an axis"),
        ("k_att=lin:1", "is not an axis"),
        ("k_att=lin:1:2:3:4", "is not an axis"),
        ("k_att=lin:a:2:3", "'a' is not a number"),
        ("k_att=1,b", "'b' is not a number"),
        ("k_att=nan", "'nan' is not finite"),
        ("k_att=lin:0:inf:3", "'inf' is not finite"),
        ("k_att=lin:2:1:3", "low 2 is greater than high 1"),
        ("k_att=log:0:1:3", "a log range must start above 0, not at 0"),
        ("k_att=log:-1:1:3", "a log range must start above 0, not at -1"),
        ("k_att=lin:0:1:0", "count 0 is less than 1"),
        ("k_att=lin:0:1:2.5", "count '2.5' is not a whole number"),
        ("k_att=lin:0:1:99999999", "count 99999999 is greater than"),
        ("k_att=lin:1:1:2", "2 values between 1 and 1 are equal"),
        ("k_att=1,2,1", "a value is given twice"),
        ("k_atz=1", "unknown parameter 'k_atz'; close: k_att"),
        ("field.lenght_scale=1", "close: field.length_scale"),
        ("att=1", "unknown parameter 'att'"),
        ("zzzzzz=1", "unknown parameter 'zzzzzz'; --list shows all"),
        ("length_scale=1", "ambiguous: collision.length_scale, field.length_scale"),
        ("k_rep=1", "ambiguous: collision.k_rep, potential.k_rep"),  # not silently the alias in small letters
    ],
)
def test_bad_axes_get_one_line(text: str, message: str) -> None:
    with pytest.raises(UsageError) as caught:
        parse_axis(text, NAMES, ALIASES)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(("text", "inside"), [("zeta=1,10", True), ("zeta=0.9,2", False), ("zeta=2,10.1", False)])
def test_domain_is_inclusive(text: str, inside: bool) -> None:
    axis = parse_axis(text, NAMES, {})
    if inside:
        check_domain(axis, {"potential.zeta": (1.0, 10.0)})
    else:
        with pytest.raises(UsageError, match=r"potential.zeta = .* is outside its domain \[1, 10\]"):
            check_domain(axis, {"potential.zeta": (1.0, 10.0)})


@pytest.mark.parametrize(
    ("names", "taken", "labels"),
    [
        (["a.k_att", "b.zeta"], (), ["k_att", "zeta"]),
        (["a.k_rep", "b.k_rep"], (), ["a_k_rep", "b_k_rep"]),
        (["motion.speed"], {"speed"}, ["motion_speed"]),
        (["speed"], {"speed"}, ["param_speed"]),
    ],
)
def test_labels_are_short_and_unique(names: list[str], taken: set[str], labels: list[str]) -> None:
    assert short_labels(names, taken) == labels


def test_labels_tell_parameters_apart_that_are_not_swept() -> None:
    """k_rep alone is the alias' parameter; another that ends so keeps more of its name."""
    assert short_labels(["potential.k_rep"], (), NAMES, ALIASES) == ["k_rep"]
    assert short_labels(["collision.k_rep"], (), NAMES, ALIASES) == ["collision_k_rep"]
    assert short_labels(["field.length_scale"], (), NAMES, ALIASES) == ["field_length_scale"]


def test_grid_is_the_product_with_the_last_axis_fastest() -> None:
    grid = make_settings(["k_att=1,2", "zeta=3,4,5"], ToyParams(), aliases=ALIASES)
    assert (grid.dims, grid.shape, grid.count) == (("k_att", "zeta"), (2, 3), 6)
    assert grid.values["potential.k_att"].tolist() == [1, 1, 1, 2, 2, 2]
    assert grid.values["potential.zeta"].tolist() == [3, 4, 5, 3, 4, 5]


@settings(deadline=None, max_examples=25)
@given(st.integers(1, 40), st.integers(0, 3))
def test_samples_stay_inside_and_repeat_with_the_seed(count: int, seed: int) -> None:
    grid = ["k_att=log:0.001:1", "zeta=lin:2:3", "field.speed=0.7"]
    one = make_settings(grid, ToyParams(), aliases=ALIASES, samples=count, sample_seed=seed)
    two = make_settings(grid, ToyParams(), aliases=ALIASES, samples=count, sample_seed=seed)
    assert (one.dims, one.shape) == (("sample",), (count,))
    for name, (low, high) in {
        "potential.k_att": (0.001, 1),
        "potential.zeta": (2, 3),
        "field.speed": (0.7, 0.7),
    }.items():
        assert ((one.values[name] >= low) & (one.values[name] <= high)).all()
        np.testing.assert_array_equal(one.values[name], two.values[name])


def test_samples_fill_each_axis_evenly_on_its_scale() -> None:
    sample = make_settings(["k_att=log:0.001:1", "zeta=lin:2:3"], ToyParams(), aliases=ALIASES, samples=64)
    decades = np.log10(sample.values["potential.k_att"])
    assert np.histogram(decades, bins=4, range=(-3, 0))[0].tolist() == [16] * 4
    assert np.histogram(sample.values["potential.zeta"], bins=4, range=(2, 3))[0].tolist() == [16] * 4
    other = make_settings(
        ["k_att=log:0.001:1", "zeta=lin:2:3"], ToyParams(), aliases=ALIASES, samples=64, sample_seed=1
    )
    assert not np.array_equal(other.values["potential.zeta"], sample.values["potential.zeta"])


@pytest.mark.parametrize(
    ("grid", "options", "message"),
    [
        ([], {}, "nothing to sweep"),
        (["zeta=1", "potential.zeta=2"], {}, "potential.zeta is given twice"),
        (["zeta=lin:1:2"], {}, "a grid needs a count"),
        (["zeta=1,2"], {"samples": 4}, "a sample needs"),
        (["zeta=lin:1:2"], {"samples": -1}, "accepted is 0 or more"),
        (["zeta=lin:1:2"], {"samples": 4, "sample_seed": -1}, "accepted is 0 or more"),
        (["zeta=lin:1:2"], {"samples": 10**8}, "more than"),
        (["zeta=lin:1:2:4000", "speed=lin:1:2:4000"], {}, "4000 x 4000 settings are more than"),
        (["zeta=0.5"], {"domains": {"potential.zeta": (1, 9)}}, "outside its domain"),
    ],
)
def test_bad_settings_get_one_line(grid: list[str], options: dict, message: str) -> None:
    with pytest.raises(UsageError, match=message):
        make_settings(grid, ToyParams(), **options)


def test_quick_keeps_few_values_and_the_ends() -> None:
    grid = ["k_att=lin:1:16:16", "zeta=2,3", "speed=lin:1:8:8"]
    quick = make_settings(grid, ToyParams(), aliases=ALIASES, quick=True)
    assert quick.shape == (4, 2, 2)
    assert quick.axes[0].values == (1, 6, 11, 16)
    assert quick.axes[2].values == (1, 8)
    assert make_settings(["zeta=lin:1:2"], ToyParams(), samples=99, quick=True).count == 16
    assert quick_axes([parse_axis("zeta=7", NAMES, {})])[0].values == (7,)
