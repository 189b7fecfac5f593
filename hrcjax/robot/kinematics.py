"""Where the links of a chain are, and how points that ride on them move."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby

import jax.numpy as jnp
import numpy as np

from hrcjax.geom.point_motion import PointMotion
from hrcjax.robot.chain import Chain
from hrcjax.robot.unrolled import (
    ZERO,
    Matrix,
    Number,
    Vector,
    add,
    apply,
    as_array,
    constant_matrix,
    constant_vector,
    cos_sin,
    cross,
    product,
    scale,
    spin,
    transpose,
)
from hrcjax.typing import Array, Float, Joints

_UPRIGHT: Matrix = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


@dataclass(frozen=True)
class _Frame:
    """A joint frame in the world, and what it takes to get there from the one before."""

    R: Matrix
    o: Vector
    step: Vector
    """From the origin of the frame before to this one, in world axes [m]."""

    @property
    def axis(self) -> Vector:
        return transpose(self.R)[2]


@dataclass(frozen=True)
class _Twist:
    """How a joint frame moves: angular and linear velocity, and the accelerations at qdd = 0."""

    omega: Vector
    v: Vector
    alpha: Vector
    a: Vector


def _joint_frames(chain: Chain, q: Joints, count: int) -> list[_Frame]:
    """The first `count` joint frames."""
    R, o = _UPRIGHT, ZERO
    frames: list[_Frame] = []
    for i in range(count):
        cos, sin = cos_sin(q[i])
        step = apply(R, constant_vector(chain.pos[i]))
        o = add(o, step)
        x, y, z = transpose(product(R, constant_matrix(chain.rotation[i])))
        x, y = add(scale(cos, x), scale(sin, y)), add(scale(cos, y), scale(-sin, x))
        R = transpose((x, y, z))
        frames.append(_Frame(R, o, step))
    return frames


def _twists(frames: Sequence[_Frame], qd: Joints) -> list[_Twist]:
    omega, v, alpha, a = ZERO, ZERO, ZERO, ZERO
    twists: list[_Twist] = []
    for i, frame in enumerate(frames):
        v = add(v, cross(omega, frame.step))
        a = add(a, apply(spin(omega, alpha), frame.step))
        turning = scale(qd[i], frame.axis)
        alpha = add(alpha, cross(omega, turning))
        omega = add(omega, turning)
        twists.append(_Twist(omega, v, alpha, a))
    return twists


def _check(chain: Chain, q: Joints, links: Sequence[int], offsets: np.ndarray) -> None:
    if q.shape != (chain.size,):
        raise ValueError(f"q has shape {q.shape}; accepted: ({chain.size},), one entry per joint of the chain")
    if any(not -1 <= link < chain.size for link in links):
        raise ValueError(f"links {tuple(links)} are not all on the chain; accepted: -1 (world) to {chain.size - 1}")
    if offsets.shape != (len(links), 3):
        raise ValueError(f"offsets have shape {offsets.shape}; accepted: ({len(links)}, 3), one row per link named")


def _in_joint_frames(chain: Chain, links: Sequence[int], offsets: np.ndarray) -> np.ndarray:
    """Places of points in the joint frames of their links, (point 3) [m]; those of the world as they are."""
    return np.array(
        [
            chain.link_pos[link] + chain.link_rotation[link] @ offset if link >= 0 else offset
            for link, offset in zip(links, np.asarray(offsets, np.float64), strict=True)
        ]
    )


def _points(chain: Chain, frames: Sequence[_Frame], links: Sequence[int], offsets: np.ndarray) -> list[Vector]:
    """The points in the world."""
    local = [constant_vector(at) for at in _in_joint_frames(chain, links, offsets)]
    return [
        at if link < 0 else add(frames[link].o, apply(frames[link].R, at))
        for link, at in zip(links, local, strict=True)
    ]


def _jacobians(frames: Sequence[_Frame], links: Sequence[int], points: Sequence[Vector], size: int) -> list[Number]:
    """Entries of J (point 3 joint), row by row."""
    moments = [cross(frame.o, frame.axis) for frame in frames]
    entries: list[Number] = []
    for link, x in zip(links, points, strict=True):
        columns = [
            add(cross(frames[j].axis, x), moments[j]) if j <= link else ZERO  # z_j x (x - o_j)
            for j in range(size)
        ]
        entries += [column[k] for k in range(3) for column in columns]
    return entries


def link_frames(chain: Chain, q: Joints) -> tuple[Float[Array, "joint 3 3"], Float[Array, "joint 3"]]:
    """Axes and origins of the links' own frames in the world: R v + p takes a point of a link to the world.

    Args:
        q: joint positions [rad].

    Returns:
        R, and p [m].

    Raises:
        ValueError: q has not one entry per joint.
    """
    n = chain.size
    _check(chain, q, (), np.zeros((0, 3)))
    frames = _joint_frames(chain, q, n)
    R = [product(frames[i].R, constant_matrix(chain.link_rotation[i])) for i in range(n)]
    p = [add(frames[i].o, apply(frames[i].R, constant_vector(chain.link_pos[i]))) for i in range(n)]
    flat = [entry for A in R for row in A for entry in row]
    return as_array(flat, (n, 3, 3), q.dtype), as_array([x for v in p for x in v], (n, 3), q.dtype)


def points_on_links(chain: Chain, q: Joints, links: Sequence[int], offsets: np.ndarray) -> Float[Array, "point 3"]:
    """Places of points that ride on links. Only the links in use are computed.

    Args:
        q: joint positions [rad].
        links: for each point, the link that carries it; -1 is the world.
        offsets: (point 3) constant places of the points in their links' own frames [m].

    Raises:
        ValueError: wrong shapes, or a link that is not on the chain.
    """
    _check(chain, q, links, offsets)
    frames = _joint_frames(chain, q, max(links, default=-1) + 1)
    points = _points(chain, frames, links, offsets)
    return as_array([x for v in points for x in v], (len(links), 3), q.dtype)


def point_jacobians(
    chain: Chain, q: Joints, links: Sequence[int], offsets: np.ndarray
) -> Float[Array, "point 3 joint"]:
    """Derivatives of the places of points by q, from the geometry: axis x (point - origin) [m/rad].

    Args and Raises: as `points_on_links`.
    """
    _check(chain, q, links, offsets)
    frames = _joint_frames(chain, q, max(links, default=-1) + 1)
    points = _points(chain, frames, links, offsets)
    return as_array(_jacobians(frames, links, points, chain.size), (len(links), 3, chain.size), q.dtype)


def point_motion(chain: Chain, q: Joints, qd: Joints, links: Sequence[int], offsets: np.ndarray) -> PointMotion:
    """Places, velocities, Jacobians and bias accelerations of points that ride on links, in one pass.

    Args:
        q: joint positions [rad].
        qd: joint speeds [rad/s].
        links: for each point, the link that carries it; -1 is the world.
        offsets: (point 3) constant places of the points in their links' own frames [m].

    Raises:
        ValueError: wrong shapes, or a link that is not on the chain.
    """
    _check(chain, q, links, offsets)
    n, dtype = chain.size, q.dtype
    if not links:
        return PointMotion(*(jnp.zeros((0, *shape), dtype) for shape in ((3,), (3,), (3, n), (3,))))
    frames = _joint_frames(chain, q, n)
    twists = _twists(frames, qd)
    x: list[Vector] = []
    xd: list[Vector] = []
    Jd_qd: list[Vector] = []
    local = _in_joint_frames(chain, links, offsets)
    for link, run in groupby(range(len(links)), key=lambda point: links[point]):
        columns = jnp.asarray(local[list(run)].T, dtype)  # one vector over the points of a link
        at = (columns[0], columns[1], columns[2])
        if link < 0:
            still = jnp.zeros_like(at[0])
            x.append(at)
            xd.append((still, still, still))
            Jd_qd.append((still, still, still))
            continue
        frame, twist = frames[link], twists[link]
        arm = apply(frame.R, at)
        x.append(add(frame.o, arm))
        xd.append(add(twist.v, cross(twist.omega, arm)))
        Jd_qd.append(add(twist.a, apply(spin(twist.omega, twist.alpha), arm)))

    axes = as_array([e for frame in frames for e in frame.axis], (n, 3), dtype)
    origins = as_array([e for frame in frames for e in frame.o], (n, 3), dtype)
    counts = [len(list(run)) for _, run in groupby(links)]
    places = _rows(x, counts, dtype)
    J = _cross(axes[None], places[:, None] - origins[None])  # z_j x (x - o_j)
    carried = np.arange(n)[None, :] <= np.asarray(links)[:, None]
    return PointMotion(
        x=places,
        xd=_rows(xd, counts, dtype),
        J=jnp.where(jnp.asarray(carried)[..., None], J, 0).swapaxes(1, 2),
        Jd_qd=_rows(Jd_qd, counts, dtype),
    )


def _rows(runs: Sequence[Vector], counts: Sequence[int], dtype: jnp.dtype) -> Float[Array, "point 3"]:
    """The points of all runs, one per row; a component that is one number, as 0 often is, holds for all points of its run."""
    columns = [
        jnp.concatenate(
            [jnp.broadcast_to(jnp.asarray(run[k], dtype), (n,)) for run, n in zip(runs, counts, strict=True)]
        )
        for k in range(3)
    ]
    return jnp.stack(columns, axis=1)


def _cross(a: Array, b: Array) -> Array:
    """Cross product over the last axis, component by component."""
    return jnp.stack(
        [
            a[..., 1] * b[..., 2] - a[..., 2] * b[..., 1],
            a[..., 2] * b[..., 0] - a[..., 0] * b[..., 2],
            a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0],
        ],
        axis=-1,
    )
