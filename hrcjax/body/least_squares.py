"""One frame's fit: Levenberg-Marquardt on points, priors and what was known before."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from hrcjax.body.params import BodyParams
from hrcjax.body.priors import Landmarks, landmark_residuals, prior_residuals, prior_slopes
from hrcjax.body.skeleton import END_A, END_B, JOINTS, LENGTHS, PART_RADIUS, PARTS, RADIUS_NAMES
from hrcjax.body.state import KNOWN, PLACES
from hrcjax.body.surface import Near, distance_slopes, nearest_parts
from hrcjax.geom.cloud import Cloud
from hrcjax.typing import Array, Float, Int, Scalar

DAMPING = 1e-3
"""First damping, as a share of the diagonal; a step that helps makes it a quarter, one that does not eight times as large [1]."""


def _part_unknowns() -> np.ndarray:
    of_joint = np.eye(PLACES).reshape(len(JOINTS), 3, PLACES)
    ends = np.stack([np.tensordot(end, of_joint, 1) for end in (END_A, END_B)], axis=1)  # (part end 3 place)
    rows = np.zeros((len(PARTS), 7, KNOWN))
    rows[:, :6, :PLACES] = ends.reshape(len(PARTS), 6, PLACES)
    rows[np.arange(len(PARTS)), 6, KNOWN - len(RADIUS_NAMES) + PART_RADIUS] = 1.0
    return rows


PART_UNKNOWNS = _part_unknowns()
"""Slopes of both ends and the radius of every part by the unknowns (part 7 known) [1]."""


class Problem(NamedTuple):
    """What a fit is to explain."""

    cloud: Cloud
    """The points of people."""
    before: Float[Array, "known"]
    """Places, lengths and radii as predicted."""
    information: Float[Array, "known known"]
    """Inverse of their covariance."""
    share: Scalar
    """See `prior_residuals`."""
    landmarks: Landmarks | None
    """Joints that somebody else found."""


def split(known: Float[Array, "known"]) -> tuple[Array, Array, Array]:
    """Joints, lengths and radii."""
    end = PLACES + len(LENGTHS)
    return known[:PLACES].reshape(len(JOINTS), 3), known[PLACES:end], known[end:]


def joined(joints: Array, lengths: Array, radii: Array) -> Float[Array, "known"]:
    """The unknowns of a fit in one vector."""
    return jnp.concatenate([joints.reshape(-1), lengths, radii])


def cost(params: BodyParams, problem: Problem, known: Float[Array, "known"]) -> tuple[Float[Array, ""], Near]:
    """Half the sum of squares, robust in the points (Geman and McClure 1987), and the parts nearest to the points."""
    joints, lengths, radii = split(known)
    near = nearest_parts(joints, radii, problem.cloud.points)
    square, doubt = near.distance**2, params.doubt**2
    of_points = jnp.sum(jnp.where(problem.cloud.mask, square * doubt / (square + doubt), 0.0)) / params.point**2
    r = prior_residuals(params, joints, lengths, problem.share)
    off = known - problem.before
    total = of_points + r @ r + off @ (problem.information @ off)
    if problem.landmarks is not None:
        found = landmark_residuals(joints, problem.landmarks)
        total = total + found @ found
    return 0.5 * total, near


def normal_equations(
    params: BodyParams, problem: Problem, known: Float[Array, "known"], near: Near
) -> tuple[Float[Array, "known known"], Float[Array, "known"]]:
    """Gauss-Newton's matrix, and the slope of the cost."""
    joints, lengths, _ = split(known)
    doubt = params.doubt**2
    weight = (doubt / (near.distance**2 + doubt)) / params.point
    weight = jnp.where(problem.cloud.mask, weight, 0.0)[:, None]
    # a point's distance depends on the ends and the radius of one part alone: sums of products by part, then all unknowns
    J, e = distance_slopes(near) * weight, near.distance[:, None] * weight
    products = J[:, :, None] * jnp.concatenate([J, e], axis=1)[:, None, :]
    of_part = (near.part == jnp.arange(len(PARTS), dtype=near.part.dtype)[:, None]).astype(J.dtype)
    sums = (of_part @ products.reshape(J.shape[0], -1)).reshape(len(PARTS), *products.shape[1:])
    spread = jnp.asarray(PART_UNKNOWNS, J.dtype)
    JJ = jnp.einsum("pij,pjk->pik", sums[:, :, :-1], spread).reshape(-1, KNOWN)
    r, by_place, by_length = prior_slopes(params, joints, lengths, problem.share)
    of_priors = jnp.concatenate([by_place, by_length, jnp.zeros((r.shape[0], len(RADIUS_NAMES)), r.dtype)], axis=1)
    left = jnp.concatenate([spread.reshape(-1, KNOWN), of_priors]).T
    A = problem.information + left @ jnp.concatenate([JJ, of_priors])
    g = problem.information @ (known - problem.before) + left @ jnp.concatenate([sums[:, :, -1].reshape(-1), r])
    if problem.landmarks is not None:
        found = landmark_residuals(joints, problem.landmarks).reshape(joints.shape)
        root = jnp.where(jnp.isfinite(problem.landmarks.joints), jnp.sqrt(problem.landmarks.weight)[:, None], 0.0)
        A = A.at[jnp.arange(PLACES), jnp.arange(PLACES)].add(root.reshape(-1) ** 2)
        g = g.at[:PLACES].add((found * root).reshape(-1))
    return A, g


def inverse_spd(A: Float[Array, "n n"]) -> Float[Array, "n n"]:
    """The inverse of a symmetric positive definite matrix, by Gauss and Jordan's sweeps, one pivot after the other.

    A library's triangular solve of 46 columns starts threads, which wait for each other for 30 ms where cores are busy; this takes 0.03 ms within a program.

    Not finite if: A is singular.
    """
    scale = 1.0 / jnp.sqrt(jnp.diagonal(A))
    each = jnp.arange(A.shape[0], dtype=jnp.int32)

    def sweep(k: Int[Array, ""], B: Array) -> Array:
        row, column, here = B[k], B[:, k], each == k
        pivot = 1.0 / row[k]
        row, column = jnp.where(here, pivot, row * pivot), jnp.where(here, -1.0, column)
        others = ~(here[:, None] | here[None, :])
        return jnp.where(others, B, 0.0) - column[:, None] * row[None, :]

    inverse = jax.lax.fori_loop(0, A.shape[0], sweep, A * scale[:, None] * scale[None, :])
    return 0.5 * (inverse + inverse.T) * scale[:, None] * scale[None, :]


def scaled_solve(A: Float[Array, "n n"], b: Float[Array, "n"]) -> Float[Array, "n"]:
    """x of A x = b, A symmetric and positive definite, with a diagonal of 1 in between: places and speeds have other sizes.

    Not finite if: A is singular.
    """
    scale = 1.0 / jnp.sqrt(jnp.diagonal(A))
    factor = jnp.linalg.cholesky(A * scale[:, None] * scale[None, :])
    return jax.scipy.linalg.cho_solve((factor, True), b * scale) * scale


def fit_body(
    params: BodyParams, problem: Problem, start: Float[Array, "known"], iterations: int
) -> tuple[Float[Array, "known"], Float[Array, ""], Near]:
    """The unknowns that explain most, their cost, and the nearest parts there.

    Levenberg-Marquardt with a fixed number of steps: one that does not lower the cost is not taken.

    Args:
        start: where to begin.
    """
    first, near = cost(params, problem, start)

    def step(carry: tuple, _: None) -> tuple[tuple, None]:
        known, value, near, damping = carry
        A, g = normal_equations(params, problem, known, near)
        tried = known - scaled_solve(A + damping * jnp.diag(jnp.diagonal(A)), g)
        new, nearer = cost(params, problem, tried)
        better = new < value  # False where it is not a number
        chosen = jax.tree.map(lambda a, b: jnp.where(better, a, b), (tried, new, nearer), (known, value, near))
        return (*chosen, jnp.where(better, damping / 4, damping * 8)), None

    begin = (start, first, near, jnp.asarray(DAMPING, start.dtype))
    (known, value, near, _), _ = jax.lax.scan(step, begin, length=iterations)
    return known, value, near
