"""Shared by all tests: both precisions, strict promotion, a compilation cache, memory, and the place of outside data."""

import ctypes
import gc
import math
import os
from collections.abc import Iterator
from pathlib import Path

import jax
import jax.numpy as jnp
import pytest

import hrcjax  # noqa: F401  # sets the flags of XLA that it needs, before a test computes
from hrcjax.numerics import compiler

# Most of the time of these tests is the compiler's: let it try less. Programs of the sweep carry options of their own; whoever compares a
# run with that of a process of its own to the bit sets the level there too.
compiler.LLVM_LEVEL = 0
os.environ["XLA_FLAGS"] = "--xla_cpu_use_fusion_emitters=false --xla_backend_optimization_level=0 " + os.environ.get(
    "XLA_FLAGS", ""
)
jax.config.update("jax_enable_x64", True)
jax.config.update("jax_numpy_dtype_promotion", "strict")
_cache = Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "hrcjax" / "xla-tests"
jax.config.update("jax_compilation_cache_dir", str(_cache))
jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.5)

# A program is traced as millions of objects, few of them in cycles: looking for these often takes a third of the time of tracing.
gc.set_threshold(500_000, 20, 100)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Files with slow tests come first: workers take whole files, and the last ones should be short."""
    slow = {item.path for item in items if item.get_closest_marker("slow")}
    items.sort(key=lambda item: item.path not in slow)


MOST = 1.2
"""Memory of a worker from which on it forgets programs [GB]."""


def resident() -> float:
    """Memory of this process [GB]; infinite where the system does not tell it."""
    told = Path("/proc/self/statm")
    return int(told.read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e9 if told.is_file() else math.inf


@pytest.fixture(scope="module", autouse=True)
def forget_programs() -> Iterator[None]:
    """After a module traced and compiled programs go if they are many: kept, they fill 6 GB in each worker of a whole run. Few are kept,
    as those of single operations and of worlds serve other modules too."""
    yield
    if resident() < MOST:
        return
    jax.clear_caches()
    gc.collect()
    libc = ctypes.CDLL(None)
    if hasattr(libc, "malloc_trim"):  # glibc: what was freed goes back to the system
        libc.malloc_trim(0)


@pytest.fixture(params=["float32", "float64"])
def dtype(request: pytest.FixtureRequest) -> jnp.dtype:
    """Both precisions: the library follows its inputs."""
    return jnp.dtype(request.param)


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """The folder of outside data (motions, RGB-D frames, models), read in place, or a skip with its reason."""
    folder = Path(os.environ.get("HRCJAX_DATA", Path(__file__).parents[2] / "shared" / "data"))
    if not folder.is_dir():
        pytest.skip(
            f"outside data not found at {folder}; set HRCJAX_DATA to the folder that holds human_motion/ and rgbd/"
        )
    return folder


@pytest.fixture(scope="session")
def shared_cases() -> Path:
    """The folder of inputs on which programs fell short, read in place, or a skip with its reason."""
    folder = Path(os.environ.get("HRCJAX_CASES", Path(__file__).parents[2] / "shared" / "cases"))
    if not folder.is_dir():
        pytest.skip(f"cases not found at {folder}; set HRCJAX_CASES to the folder that holds bvh_z_up/")
    return folder
