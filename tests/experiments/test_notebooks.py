"""Notebooks run from the first cell to the last."""

import os
from pathlib import Path
from queue import Empty
from time import monotonic
from typing import Any

import jupytext
import nbclient
import pytest
from toy_run import make_run

NOTEBOOKS = Path(__file__).parents[2] / "notebooks"


ASK_AGAIN = 5.0
"""Longest wait for a message before the socket is looked at again [s]."""


def look_again(channel: Any) -> None:
    """Makes a channel look at its socket every few seconds: ZeroMQ's asyncio poller may miss a wake-up, and hands a message that has
    arrived over when the wait ends (pyzmq 1558), here after the whole timeout of a cell."""
    once = channel.get_msg

    async def get_msg(timeout: float | None = None) -> Any:
        end = float("inf") if timeout is None else monotonic() + timeout
        while True:
            left = max(end - monotonic(), 0.0)
            try:
                return await once(timeout=min(left, ASK_AGAIN))
            except Empty:
                if left <= ASK_AGAIN:
                    raise

    channel.get_msg = get_msg


class Client(nbclient.NotebookClient):
    """A client that misses no message."""

    async def async_start_new_kernel_client(self) -> Any:
        client = await super().async_start_new_kernel_client()
        for channel in (client.shell_channel, client.iopub_channel):
            look_again(channel)
        return client


def images_of(name: str) -> int:
    """Pictures that a notebook shows."""
    notebook = jupytext.read(NOTEBOOKS / name)
    place = {"metadata": {"path": str(NOTEBOOKS)}}
    Client(notebook, timeout=600, kernel_name="python3", resources=place).execute()
    outputs = [output for cell in notebook.cells for output in cell.get("outputs", [])]
    return sum("image/png" in output.get("data", {}) for output in outputs)


@pytest.mark.slow
def test_first_sweep(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    run = make_run(tmp_path / "r", "--grid", "K_att=log:0.01:0.1:3", "K_rep=lin:0.1:1:3", "zeta=2,4")
    monkeypatch.setenv("HRCJAX_RUN", str(run))
    assert images_of("01_first_sweep.py") == 4


@pytest.mark.slow
def test_one_frame() -> None:
    assert images_of("02_one_frame.py") == 6


@pytest.mark.slow
def test_what_the_knobs_do(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    run = make_run(tmp_path / "r", "--grid", "K_att=log:0.01:0.1:3", "K_rep=lin:0.1:1:3", "zeta=2,4")
    monkeypatch.setenv("HRCJAX_RUN", str(run))
    assert images_of("03_what_the_knobs_do.py") == 4


@pytest.mark.slow
@pytest.mark.skipif("HRCJAX_ALL" not in os.environ, reason="minutes of compilation: HRCJAX_ALL=1 runs it")
def test_tune_by_gradient() -> None:
    pytest.importorskip("optax")
    assert images_of("04_tune_by_gradient.py") == 3


@pytest.mark.slow
@pytest.mark.skipif("HRCJAX_ALL" not in os.environ, reason="minutes of compilation: HRCJAX_ALL=1 runs it")
def test_a_reach_past_an_arm() -> None:
    assert images_of("06_a_reach_past_an_arm.py") == 5


@pytest.mark.slow
@pytest.mark.skipif("HRCJAX_ALL" not in os.environ, reason="minutes of compilation: HRCJAX_ALL=1 runs it")
def test_from_a_cloud_to_a_grasp() -> None:
    assert images_of("05_from_a_cloud_to_a_grasp.py") == 4


@pytest.mark.slow
@pytest.mark.skipif("HRCJAX_ALL" not in os.environ, reason="a minute of compilation: HRCJAX_ALL=1 runs it")
def test_from_an_image_to_a_motion() -> None:
    assert images_of("07_from_an_image_to_a_motion.py") == 4
