"""Arms from MJCF files."""

# pyright: reportAttributeAccessIssue=false
# mujoco's types are compiled and have no stubs

from pathlib import Path
from typing import Any

import mujoco

from hrcjax.lab.errors import UsageError, one_line
from hrcjax.robot import Arm
from hrcjax.robot.from_model import arm_from_model


def read_arm(path: str | Path, **figures: Any) -> Arm:
    """The arm that an MJCF file describes.

    Args:
        path: of the file; its meshes must exist, although the arm's shape is that of its capsules.
        figures: data that MJCF does not have: see `arm_from_model`.

    Raises:
        UsageError: no such file, invalid MJCF, or not a serial chain of hinges with capsules and a tool.
    """
    try:
        model = mujoco.MjModel.from_xml_path(str(path))
        return arm_from_model(model, Path(path).stem, **figures)
    except ValueError as error:
        raise UsageError(f"{path}: {one_line(error)}") from error
