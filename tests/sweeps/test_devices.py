"""Chunks on several devices: the numbers of one device, whatever their number."""

import os
import subprocess
import sys
from pathlib import Path

import jax
import pytest

from hrcjax.lab.errors import UsageError
from hrcjax.sweeps.devices import Spread, choose_devices

EIGHT = """
import hrcjax, io, sys
from dataclasses import replace
from pathlib import Path
import jax, numpy as np, toy_cell
from hrcjax.sweeps.devices import choose_devices
from hrcjax.sweeps.engine import run_sweep
from hrcjax.sweeps.settings import make_settings
from hrcjax.sweeps.store import open_store

root = Path(sys.argv[1])
jax.config.update("jax_compilation_cache_dir", str(root / "cache"))
problem = replace(toy_cell.build_problem(("robotica", "hri"), ("reach_in",), (0,)), identity="toy")
settings = make_settings(["k_att=log:0.01:0.1:11", "zeta=lin:2:4:3"], problem.params, aliases=problem.aliases)

def run(count, name):
    with open_store(root / name, "f", {"identity": {}}) as store:
        tally = run_sweep(problem, settings, store, 4, stream=io.StringIO(), devices=choose_devices(count))
        assert tally.computed == 66 and tally.statuses == {0: 66}
        return {key.name: store.read(key.stem) for key in sorted((root / name / "chunks").iterdir())}

one = run(1, "one")
assert len(one) == 2 * (9 + 1) and len(jax.devices()) == 8
for name, count in (("eight", 8), ("three", 3), ("again", 8)):  # 9 chunks: 8 and 1; three times 3; the program read back
    traced = len(toy_cell.TRACES)
    other = run(count, name)
    assert (len(toy_cell.TRACES) == traced) == (name == "again")
    assert list(one) == list(other)
    for key in one:
        for array in one[key]:
            np.testing.assert_array_equal(one[key][array], other[key][array], err_msg=f"{name} {key} {array}")
print("equal")
"""


def test_eight_devices_give_the_numbers_of_one_to_the_bit(tmp_path: Path) -> None:
    here = Path(__file__).parents[1]
    environment = {
        **os.environ,
        "JAX_PLATFORMS": "cpu",
        "XLA_FLAGS": "--xla_force_host_platform_device_count=8",
        "PYTHONPATH": os.pathsep.join([str(here.parent), str(here / "helpers")]),
    }
    words = [sys.executable, "-c", EIGHT, str(tmp_path)]
    done = subprocess.run(words, env=environment, capture_output=True, text=True)
    assert done.returncode == 0 and done.stdout == "equal\n", done.stderr[-3000:]


def test_more_devices_than_there_are_is_refused() -> None:
    there = len(jax.local_devices())
    with pytest.raises(UsageError, match=rf"--devices {there + 1}: accepted is 1 to {there}"):
        choose_devices(there + 1)


@pytest.mark.skipif(jax.default_backend() != "cpu", reason="of accelerators all are taken")
def test_of_a_cpu_one_device_is_taken() -> None:
    assert choose_devices(0) == jax.local_devices()[:1]


def test_groups_hold_every_chunk_once() -> None:
    assert list(Spread((None,) * 3).groups([0, 2, 5, 6])) == [[0, 2, 5], [6]]
