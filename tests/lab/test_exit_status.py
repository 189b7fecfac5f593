"""What a program says and returns when the system stops it or lacks what the shell asks for."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import jax
import pytest

from hrcjax.lab.errors import Terminated, exit_status

ROOT = Path(__file__).parents[2]


def test_sigterm_ends_as_an_interrupt_does(capsys: pytest.CaptureFixture[str]) -> None:
    cleaned = []

    def program() -> int:
        try:
            os.kill(os.getpid(), signal.SIGTERM)
            signal.pause()
        finally:
            cleaned.append(True)
        return 0

    assert exit_status(program, "stopped here") == 143
    assert capsys.readouterr().err == "error: stopped here\n" and cleaned == [True]
    assert signal.getsignal(signal.SIGTERM) is signal.SIG_DFL


def test_sigterm_within_a_callback_of_compiled_code(capsys: pytest.CaptureFixture[str]) -> None:
    def program() -> int:
        try:
            os.kill(os.getpid(), signal.SIGTERM)
            signal.pause()
        except Terminated as stop:
            raise jax.errors.JaxRuntimeError("INTERNAL: CpuCallback error calling callback: Terminated") from stop
        return 0

    assert exit_status(program, "stopped here") == 143
    assert capsys.readouterr().err == "error: stopped here\n"


def test_sigterm_that_is_ignored_stays_so() -> None:
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    try:
        assert exit_status(lambda: os.kill(os.getpid(), signal.SIGTERM) or 5) == 5
    finally:
        signal.signal(signal.SIGTERM, signal.SIG_DFL)


def test_interrupt_is_130(capsys: pytest.CaptureFixture[str]) -> None:
    def stop(kind: type[BaseException]) -> int:
        raise kind

    assert [exit_status(lambda kind=kind: stop(kind)) for kind in (KeyboardInterrupt, Terminated)] == [130, 143]


@pytest.mark.parametrize("platform", ["cuda", "nonsense"])
def test_a_device_that_is_not_there_is_one_line(platform: str) -> None:
    code = "import sys; from experiments.__main__ import main; sys.exit(main(['sweep', '--list']))"
    environment = {**os.environ, "JAX_PLATFORMS": platform}
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, env=environment, capture_output=True, text=True)
    if platform == "cuda" and done.returncode == 0:
        pytest.skip("there is a GPU here")
    (line,) = done.stderr.splitlines()
    assert done.returncode == 2 and done.stdout == ""
    assert line.startswith(f"error: JAX_PLATFORMS={platform} in the environment: not available here")
    assert line.endswith("unset it, or set it to cpu")


def test_faults_of_the_program_stay_faults(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("JAX_PLATFORMS", "cpu")

    def fault() -> int:
        raise AssertionError("2 + 2")

    with pytest.raises(AssertionError, match="2 \\+ 2"):
        exit_status(fault)

    def full() -> int:
        raise jax.errors.JaxRuntimeError("RESOURCE_EXHAUSTED: out of memory")

    assert exit_status(full, memory="less") == 1
