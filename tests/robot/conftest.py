"""Both arms."""

import pytest

from hrcjax.robot import Arm, load_arm


@pytest.fixture(scope="session", params=["ur5", "ur5e"])
def arm(request: pytest.FixtureRequest) -> Arm:
    return load_arm(request.param)


@pytest.fixture(scope="session")
def ur5() -> Arm:
    return load_arm("ur5")
