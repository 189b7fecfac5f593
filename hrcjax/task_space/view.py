"""One camera's look at a still scene: the mean of several depth images, where every pixel lies, and how sure that is.

On the host, in NumPy: instances have no fixed number, and a scene is mapped once.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, UInt
from scipy import ndimage

from hrcjax.sense import Camera, NoiseParams

LEAST_SHARE = 0.3
"""Share of the images that must have measured a pixel [1]."""
OUTLIER = 3.0
"""Measurements farther from a pixel's median than this many standard deviations are left out of its mean [1]."""


class View(NamedTuple):
    """A still scene from one place."""

    rotation: Float[np.ndarray, "3 3"]
    """World from camera."""
    position: Float[np.ndarray, "3"]
    """Of the pinhole in the world [m]."""
    focal: Float[np.ndarray, "2"]
    """fx and fy [px]."""
    centre: Float[np.ndarray, "2"]
    """cx and cy [px]."""
    depth: Float[np.ndarray, "height width"]
    """Along the optical axis; 0: no measurement [m]."""
    deviation: Float[np.ndarray, "height width"]
    """Standard deviation of the depth [m]."""
    colour: UInt[np.ndarray, "height width 3"] | None = None
    """Red, green and blue, as far as there is a colour image in the same pixels."""


def mean_depth(
    images: Float[np.ndarray, "image height width"], noise: NoiseParams
) -> tuple[Float[np.ndarray, "height width"], Float[np.ndarray, "height width"]]:
    """Depth of a still scene from several images of one camera, and its standard deviation [m].

    The mean of what lies near a pixel's median: a pixel that flies in some images does not count there. 0 where fewer than
    `LEAST_SHARE` of the images measured anything.
    """
    measured = np.isfinite(images) & (images > 0)
    count = measured.sum(0)
    enough = count >= max(1, LEAST_SHARE * len(images))
    order = np.sort(np.where(measured, images, np.inf), axis=0)  # what is not measured comes last
    middle = np.take_along_axis(order, (np.maximum(count, 1) - 1)[None] // 2, axis=0)[0]
    median = np.where(enough, middle, 0.0)
    one = median**2 * noise.subpixel / (noise.focal * noise.baseline)
    near = measured & (np.abs(images - median) <= OUTLIER * one + noise.step)
    used = near.sum(0)
    mean = np.where(near, images, 0).sum(0) / np.maximum(used, 1)
    deviation = np.hypot(one / np.sqrt(np.maximum(used, 1)), noise.step / np.sqrt(12))
    return np.where(enough & (used > 0), mean, 0.0), np.where(enough, deviation, 0.0)


def view_of(
    camera: Camera,
    images: Float[np.ndarray, "image height width"],
    noise: NoiseParams | None = None,
    colour: UInt[np.ndarray, "height width 3"] | None = None,
) -> View:
    """The view of one camera that took `images` of a still scene [m].

    Raises:
        ValueError: images of another size than the camera's.
    """
    if images.ndim != 3 or images.shape[1:] != (camera.height, camera.width):
        raise ValueError(f"images of {images.shape} for a camera of {(camera.height, camera.width)} (rows, columns)")
    depth, deviation = mean_depth(np.asarray(images, float), NoiseParams() if noise is None else noise)
    focal, centre = np.array([camera.fx, camera.fy], float), np.array([camera.cx, camera.cy], float)
    return View(np.array(camera.rotation, float), np.array(camera.position, float), focal, centre, depth, deviation, colour)  # fmt: skip


def rays(view: View, window: tuple[slice, slice] | None = None) -> Float[np.ndarray, "height width 3"]:
    """Directions of the pixels in the world, with length 1 along the optical axis [1].

    Args:
        window: rows and columns with bounds, of the pixels that are wanted; None: all.
    """
    whole = (slice(0, view.depth.shape[0]), slice(0, view.depth.shape[1]))
    rows, columns = np.mgrid[whole if window is None else window]
    x, y = (columns - view.centre[0]) / view.focal[0], (rows - view.centre[1]) / view.focal[1]
    return np.stack([x, y, np.ones_like(x)], -1) @ view.rotation.T


def points(view: View) -> Float[np.ndarray, "height width 3"]:
    """Where every pixel lies in the world; the pinhole where there is no measurement [m]."""
    return view.position + view.depth[..., None] * rays(view)


def turned(view: View, rotation: Float[np.ndarray, "3 3"], shift: Float[np.ndarray, "3"]) -> View:
    """The same view in the frame whose coordinates are rotation x + shift."""
    return view._replace(rotation=rotation @ view.rotation, position=rotation @ view.position + shift)


def in_image(view: View, place: Float[np.ndarray, "*point 3"]) -> tuple[np.ndarray, np.ndarray]:
    """Pixel coordinates (column, row) of points [px], and their depth [m]; 0 or less behind the camera."""
    local = (place - view.position) @ view.rotation
    z = local[..., 2]
    safe = np.where(z > 1e-6, z, 1.0)
    return local[..., :2] / safe[..., None] * view.focal + view.centre, z


def steady(view: View, gap: float = 0.02) -> Bool[np.ndarray, "height width"]:
    """True where two neighbours at least, of four, lie within gap and four standard deviations of a pixel's depth [m]:
    no flying pixel, nor a surface narrower than two pixels."""
    padded = np.pad(np.where(view.depth > 0, view.depth, np.inf), 1, constant_values=np.inf)
    own = np.where(view.depth > 0, view.depth, 0)
    near = [np.abs(own - padded[i : i + own.shape[0], j : j + own.shape[1]]) <= gap + 4 * view.deviation for i, j in ((0, 1), (2, 1), (1, 0), (1, 2))]  # fmt: skip
    return (view.depth > 0) & (np.sum(near, axis=0) >= 2)


def normals(
    view: View, window: int = 9
) -> tuple[Float[np.ndarray, "height width 3"], Bool[np.ndarray, "height width"]]:
    """Normals on the side of the camera, in the world, by the plane through the points of a window; and where there is one.

    The plane is fitted to inverse depth, which is linear over a plane's pixels: 1/z = a x + b y + c has the normal (a, b, c),
    in camera axes. Where less than half of the window is measured, or its residual is far over the noise, there is none.
    """
    known = view.depth > 0
    w = known.astype(float)
    z = np.where(known, view.depth, 1.0)
    g = w / z
    rows, columns = np.mgrid[: z.shape[0], : z.shape[1]].astype(float)
    half = window // 2
    step = np.arange(-half, half + 1.0)
    ones = np.ones(window)

    def total(image: np.ndarray, down: np.ndarray, across: np.ndarray) -> np.ndarray:
        return ndimage.correlate1d(ndimage.correlate1d(image, down, 0, mode="constant"), across, 1, mode="constant")

    s0, sx, sy = total(w, ones, ones), total(w, ones, step), total(w, step, ones)
    sxx, syy, sxy = total(w, ones, step**2), total(w, step**2, ones), total(w, step, step)
    t0, tx, ty = total(g, ones, ones), total(g, ones, step), total(g, step, ones)
    count = np.maximum(s0, 1)
    mx, my, mt = sx / count, sy / count, t0 / count
    vxx, vyy, vxy = sxx - sx * mx, syy - sy * my, sxy - sx * my
    vxt, vyt = tx - sx * mt, ty - sy * mt
    det = np.maximum(vxx * vyy - vxy**2, 1e-9)
    a, b = (vyy * vxt - vxy * vyt) / det, (vxx * vyt - vxy * vxt) / det  # slope of 1/z per pixel
    left = np.maximum(total(w * (g**2), ones, ones) - t0 * mt - a * vxt - b * vyt, 0) / count
    noise = np.where(known, view.deviation / z**2, 0)
    flat = left <= (3 * noise) ** 2 + 1e-8
    ax, by = a * view.focal[0], b * view.focal[1]
    x, y = (columns - view.centre[0]) / view.focal[0], (rows - view.centre[1]) / view.focal[1]
    n = np.stack([ax, by, mt - (a * mx + b * my) - ax * x - by * y], -1)
    length = np.linalg.norm(n, axis=-1)
    exists = known & flat & (s0 >= window * window / 2) & (length > 1e-9)
    return -(n / np.maximum(length, 1e-9)[..., None]) @ view.rotation.T, exists
