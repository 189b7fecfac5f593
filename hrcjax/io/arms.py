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
        path: of the file; meshes that it names must be there, though the arm's shape comes from its capsules.
        figures: what MJCF leaves open: see `arm_from_model`.

    Raises:
        UsageError: no such file, no MJCF, or not one chain of hinges with capsules and a tool.
    """
    try:
        model = mujoco.MjModel.from_xml_path(str(path))
        return arm_from_model(model, Path(path).stem, **figures)
    except ValueError as error:
        raise UsageError(f"{path}: {one_line(error)}") from error
