"""One frame's fit: Levenberg-Marquardt on points, priors and what was known before."""

from typing import NamedTuple

import jax
import jax.numpy as jnp

from hrcjax.body.params import BodyParams
from hrcjax.body.priors import Landmarks, landmark_residuals, prior_residuals, prior_slopes
from hrcjax.body.skeleton import JOINTS, LENGTHS, RADIUS_NAMES
from hrcjax.body.state import KNOWN, PLACES
from hrcjax.body.surface import Near, distance_slopes, nearest_parts
from hrcjax.geom.cloud import Cloud
from hrcjax.typing import Array, Float, Int, Scalar

DAMPING = 1e-3
"""First damping, as a share of the diagonal; a step that helps makes it a quarter, one that does not eight times as large [1]."""


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
    weight = jnp.where(problem.cloud.mask, weight, 0.0)
    J = distance_slopes(near) * weight[:, None]
    JJ, Je = J.T @ J, J.T @ (near.distance * weight)
    radii = KNOWN - len(RADIUS_NAMES)
    A, g = problem.information, problem.information @ (known - problem.before)
    A = A.at[:PLACES, :PLACES].add(JJ[:PLACES, :PLACES]).at[radii:, radii:].add(JJ[PLACES:, PLACES:])
    A = A.at[:PLACES, radii:].add(JJ[:PLACES, PLACES:]).at[radii:, :PLACES].add(JJ[PLACES:, :PLACES])
    g = g.at[:PLACES].add(Je[:PLACES]).at[radii:].add(Je[PLACES:])
    r, by_place, by_length = prior_slopes(params, joints, lengths, problem.share)
    P = jnp.concatenate([by_place, by_length], axis=1)
    A, g = A.at[:radii, :radii].add(P.T @ P), g.at[:radii].add(P.T @ r)
    if problem.landmarks is not None:
        found = landmark_residuals(joints, problem.landmarks).reshape(joints.shape)
        root = jnp.where(jnp.isfinite(problem.landmarks.joints), jnp.sqrt(problem.landmarks.weight)[:, None], 0.0)
        A = A.at[jnp.arange(PLACES), jnp.arange(PLACES)].add(root.reshape(-1) ** 2)
        g = g.at[:PLACES].add((found * root).reshape(-1))
    return A, g


def inverse_spd(A: Float[Array, "n n"]) -> Float[Array, "n n"]:
    """The inverse of a symmetric positive definite matrix, by Gauss and Jordan's sweeps, one pivot after the other.

    A library's triangular solve of 46 columns starts threads, which wait for each other for 30 ms where cores are busy; this takes 0.2 ms.

    Not finite if: A is singular.
    """
    scale = 1.0 / jnp.sqrt(jnp.diagonal(A))

    def sweep(k: Int[Array, ""], B: Array) -> Array:
        row = B[k] / B[k, k]
        column = B[:, k].at[k].set(-1.0)
        swept = B.at[:, k].set(0.0).at[k].set(0.0) - column[:, None] * row.at[k].set(1.0 / B[k, k])[None, :]
        return swept

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
