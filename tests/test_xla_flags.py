"""The pinned jax is wrong on a CPU for some shapes; with the flag that importing hrcjax sets it is right."""

import os
import subprocess
import sys

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from hrcjax.numerics import unrolled_options
from hrcjax.xla_flags import OPTION, VALUE, switch_off_ynnpack

SHAPES = [(32_769, np.float32), (40_961, np.float32), (16_385, np.float64)]
WRONG = {OPTION: "LIBRARY_FUSION_TYPE_REDUCE"}
"""What jax 0.10.2 does of itself."""


def wrong_rows(count: int, dtype: type, options: dict) -> int:
    """How many of the sums over M r, squared, are not NumPy's."""
    random = np.random.default_rng(0)
    M, rows = random.normal(size=(3, 3)).astype(dtype), random.normal(size=(count, 3)).astype(dtype)

    def of_rows(rows):
        return jax.vmap(lambda r: jnp.sum((jnp.asarray(M) @ r) ** 2))(rows)

    found = jax.jit(of_rows, compiler_options=options)(jnp.asarray(rows))
    expected = np.sum((rows.astype(np.float64) @ M.T.astype(np.float64)) ** 2, axis=1)
    return int(np.sum(np.abs(np.asarray(found) - expected) > 1e-4 * (1 + expected)))


@pytest.mark.skipif(jax.default_backend() != "cpu", reason="the fault is that of XLA on a CPU")
@pytest.mark.parametrize("count, dtype", SHAPES)
class TestCanary:
    def test_programs_of_ours_are_right(self, count, dtype):
        assert wrong_rows(count, dtype, {}) == 0
        assert wrong_rows(count, dtype, unrolled_options()) == 0

    def test_the_pinned_jax_is_wrong_of_itself(self, count, dtype):
        assert wrong_rows(count, dtype, WRONG) > 0, (
            "jax no longer needs hrcjax/xla_flags.py: remove it with its call in hrcjax/__init__.py, this test and the "
            "comment beside the pin in pyproject.toml"
        )


OF_ITSELF = """
import os, sys
os.environ.pop("XLA_FLAGS", None)
{first}
import jax, jax.numpy as jnp, numpy as np
rows = np.arange(3 * 40_961, dtype=np.float32).reshape(-1, 3) % 7
f = jax.jit(jax.vmap(lambda r: jnp.sum((jnp.eye(3) @ r) ** 2)))
print(np.sum(np.asarray(f(rows)) != np.sum(rows**2, axis=1)))
"""


@pytest.mark.parametrize("first, right", [("import hrcjax", True), ("", False)])
def test_in_a_process_of_its_own(first, right):
    """As a user's script: right because hrcjax was imported, wrong without."""
    script = [sys.executable, "-c", OF_ITSELF.format(first=first)]
    environment = {**os.environ, "JAX_PLATFORMS": "cpu", "JAX_ENABLE_COMPILATION_CACHE": "false"}
    done = subprocess.run(script, env=environment, capture_output=True, text=True, check=True)
    assert (int(done.stdout) == 0) == right, done.stdout + done.stderr


class TestFlag:
    @pytest.fixture(autouse=True)
    def unstarted(self, monkeypatch):
        """As if no backend ran yet."""
        monkeypatch.setattr(jax._src.xla_bridge, "backends_are_initialized", lambda: False)

    def test_is_added_to_the_users_flags(self, monkeypatch):
        monkeypatch.setenv("XLA_FLAGS", "--xla_dump_to=here")
        switch_off_ynnpack()
        assert os.environ["XLA_FLAGS"] == f"--xla_dump_to=here --{OPTION}={VALUE}"

    def test_stays_as_the_user_set_it(self, monkeypatch):
        monkeypatch.setenv("XLA_FLAGS", f"--{OPTION}=")
        switch_off_ynnpack()
        assert os.environ["XLA_FLAGS"] == f"--{OPTION}="

    def test_too_late_is_said(self, monkeypatch):
        monkeypatch.delenv("XLA_FLAGS", raising=False)
        monkeypatch.setattr(jax._src.xla_bridge, "backends_are_initialized", lambda: True)
        monkeypatch.setattr(jax, "default_backend", lambda: "cpu")
        with pytest.warns(RuntimeWarning, match="import hrcjax before the first computation"):
            switch_off_ynnpack()
        assert os.environ["XLA_FLAGS"] == f"--{OPTION}={VALUE}"

    def test_in_a_file(self, monkeypatch, tmp_path):
        file = tmp_path / "flags"
        file.write_text("--xla_dump_to=here\n")
        monkeypatch.setenv("XLA_FLAGS", str(file))
        with pytest.warns(RuntimeWarning, match="add a line"):
            switch_off_ynnpack()
        file.write_text(f"--{OPTION}=\n")
        switch_off_ynnpack()
        assert os.environ["XLA_FLAGS"] == str(file)
