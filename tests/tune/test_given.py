"""Parameters from a file in place of the defaults: the three forms of a place, what differs, and messages."""

from pathlib import Path

import numpy as np
import pytest

from hrcjax.lab import configs
from hrcjax.lab.errors import UsageError
from hrcjax.lab.parameters import leaf_names
from hrcjax.sim import Params
from hrcjax.tune.given import given_params
from hrcjax.tune.tuned import TUNED, write_tuned

VALUES = {"potential.k_att": 0.125, "policy.target.kp": 7.5}


@pytest.fixture
def shipped(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder of named settings with one file of tuned parameters, "quick"."""
    folder = tmp_path / "configs/tuned"
    folder.mkdir(parents=True)
    write_tuned(folder / "quick.toml", VALUES, "")
    monkeypatch.setattr(configs, "_PACKAGE", tmp_path)
    return folder


def test_a_file_a_folder_and_a_name_are_the_same(
    shipped: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = tmp_path / "quick"
    run.mkdir()
    write_tuned(run / TUNED, {"potential.zeta": 3.0}, "")
    monkeypatch.chdir(tmp_path)
    for place in ("quick", shipped / "quick.toml", str(shipped / "quick.toml")):
        found = leaf_names(given_params(Params(), place, "--params").params)
        assert found == leaf_names(Params()) | VALUES
    assert list(given_params(Params(), "./quick", "--params").changed) == ["potential.zeta"], "not the shipped one"
    with pytest.raises(UsageError, match=r"--params quik: no tuned.toml there; .*, or one of quick"):
        given_params(Params(), "quik", "--params")


def test_the_line_names_what_differs_and_what_is_swept(tmp_path: Path) -> None:
    old = leaf_names(Params())
    same = {"plan.omega2": float(np.float32(old["plan.omega2"]))}
    assert same["plan.omega2"] != old["plan.omega2"], "but by rounding alone"
    write_tuned(tmp_path / TUNED, {**VALUES, **same, "potential.k_rep": 2.0}, "")
    given = given_params(Params(), tmp_path, "--params")
    assert given.line({"potential.k_rep"}) == (
        f"parameters of {tmp_path}: 3 differ from the defaults: potential.k_att {old['potential.k_att']:g} -> 0.125, "
        f"policy.target.kp {old['policy.target.kp']:g} -> 7.5, potential.k_rep {old['potential.k_rep']:g} -> 2 (swept)"
    )
    write_tuned(tmp_path / TUNED, same, "")
    assert given_params(Params(), tmp_path, "--params").line().endswith("none differs from the defaults")
    assert given_params(Params(), "", "--params").place == ""


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"potential.k_at": 0.1}, r"--params .*: the cell has no parameter 'potential.k_at'"),
        ({"potential.zeta": 20.0}, r"--params .*: potential.zeta = 20 is outside of its domain \[1, 10\]"),
        ({"potential.k_att": float("nan")}, r"potential.k_att = nan is outside"),
    ],
)
def test_messages(values: dict[str, float], message: str, tmp_path: Path) -> None:
    write_tuned(tmp_path / TUNED, values, "")
    with pytest.raises(UsageError, match=message):
        given_params(Params(), tmp_path, "--params", {"potential.zeta": (1.0, 10.0)})
