"""An animation of one lift, as a GIF that Pillow writes."""

import io
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from hrcjax.grasp.gripper import Gripper

from .lift import lift
from .objects import shape_named
from .picture import Viewpoint, picture
from .scene import TIMESTEP, make_scene

RATE = 12.5
"""Pictures in a second [Hz]."""
EYE = np.array([0.42, -0.55, 0.36])
"""Of the picture, from the object [m]."""


def lift_gif(name: str, case: Mapping[str, NDArray], way: str = "hessian") -> bytes:
    """The lift of a stored object by its chosen grasp.

    Raises:
        ValueError: the way found no grasp.
    """
    taken = int(case[f"{way}_taken"])
    if taken < 0:
        raise ValueError(f"{name}: no grasp by {way}")
    scene = make_scene(shape_named(name), (case["place"], float(case["yaw"]), int(case["rest"])), Gripper())
    middle = np.array([*case["place"], 0.11])
    view = Viewpoint(middle + EYE, middle, 300, 360, 560.0)
    pictures: list[Image.Image] = []
    each, step = round(1 / (RATE * TIMESTEP)), 0

    def watch() -> None:
        nonlocal step
        if step % each == 0:
            pictures.append(Image.fromarray((255 * picture(scene, view)).astype(np.uint8)))
        step += 1

    R, p = case[f"{way}_R"][taken].astype(float), case[f"{way}_p"][taken].astype(float)
    lift(scene, R, p, float(case[f"{way}_opening"][taken]), watch=watch)
    file = io.BytesIO()
    palette = pictures[len(pictures) // 2].quantize(96)
    frames = [one.quantize(palette=palette, dither=Image.Dither.NONE) for one in pictures]
    frames[0].save(
        file, "GIF", save_all=True, append_images=frames[1:], duration=round(1000 / RATE), loop=0, optimize=True
    )
    return file.getvalue()
