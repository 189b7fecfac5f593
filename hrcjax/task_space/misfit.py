"""How much worse a shape fits the points of a thing than their noise explains."""

import numpy as np
from jaxtyping import Float

from hrcjax.task_space.instances import Part
from hrcjax.task_space.shape_fit import FitParams
from hrcjax.task_space.solid_distance import Solid, solid_distances, solid_normals
from hrcjax.task_space.view import View


def misfit(
    views: list[View], parts: list[Part], flat: list[Float[np.ndarray, "_ 3"]], solid: Solid, params: FitParams
) -> float:
    """Root mean square distance of points from a surface over what is expected of it, large ones by Cauchy's law [1].

    Depth is noisy along a ray, so that a surface seen aslant by the angle a to its normal has cos(a) of that noise across it; what a real surface
    differs from the shape's is added. 1, or less, is a thing of that shape, however it is seen.

    Args:
        flat: points of all pixels of every view [m].
    """
    square = []
    for part in parts:
        view, place = views[part.view], flat[part.view][part.pixels]
        ray = place - view.position
        along = ray / (ray @ view.rotation[:, 2])[:, None] * view.deviation.ravel()[part.pixels][:, None]
        across = np.sum(solid_normals(*solid, place) * along, axis=-1)
        square.append(solid_distances(*solid, place) ** 2 / (across**2 + params.model**2))
    c = params.robust
    return float(np.sqrt(np.mean(c**2 * np.log1p(np.concatenate(square) / c**2))))
