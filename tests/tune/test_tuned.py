"""The file of tuned parameters: read back to the bit, and refused where it is something else."""

from pathlib import Path

import numpy as np
import pytest

from hrcjax.lab.errors import UsageError
from hrcjax.tune.tuned import TUNED, read_training, read_tuned, write_tuned


def test_round_trip(tmp_path: Path) -> None:
    values = {"potential.k_att": float(np.float32(0.1)), "policy.target.kp": 1e-7, "motion.speed": 2.0}
    write_tuned(tmp_path / TUNED, values, 'Command: a --b "c"\n\nWorlds: é')
    assert read_tuned(tmp_path / TUNED, "--from") == values
    assert read_tuned(tmp_path, "--from") == values, "the folder of a run"


@pytest.mark.parametrize(
    "text",
    ["a = 1", "[parameters]\n'a' = 'text'", "[parameters]\n'a' = true", "[parameters]\na.b = 1", "parameters = ["],
)
def test_other_files_are_refused(text: str, tmp_path: Path) -> None:
    (tmp_path / "x.toml").write_text(text)
    with pytest.raises(UsageError, match=r"--from .*x\.toml"):
        read_tuned(tmp_path / "x.toml", "--from")
    with pytest.raises(UsageError, match=f"no {TUNED} there"):
        read_tuned(tmp_path, "--from")


def test_the_worlds_of_the_training_are_kept(tmp_path: Path) -> None:
    training = {"robotica-0-reach_in": {"scene": "a1", "person": "b2"}, 'hri-1-a "b"\\c.bvh,unit=cm': {"scene": "é"}}
    write_tuned(tmp_path / TUNED, {"a.b": 1.0}, "", training)
    assert read_training(tmp_path, "--from") == training and read_tuned(tmp_path, "--from") == {"a.b": 1.0}
    write_tuned(tmp_path / TUNED, {"a.b": 1.0}, "")
    assert read_training(tmp_path, "--from") == {}
