"""A minimum under inequalities, to compare with: an augmented Lagrangian around SciPy's L-BFGS-B.

Source: Nocedal and Wright, Numerical Optimization (2006), section 17.4; an inequality's multiplier by Rockafellar's form.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

FIRST_PENALTY = 30.0
"""A soft one, which lets the path slip through an obstacle to a better side."""
FACTOR = 4.0
"""Growth of the penalty after a round that has not divided the residual by this."""
CLOSE = 1e-6
"""Residual at which the rounds end, in the unit of the constraints."""
FLAT = 1e-3
"""Slope at which they end, in the root of the objective's unit."""


class Problem(NamedTuple):
    """Minimise an objective where all constraints are 0 or more."""

    augmented: Callable[[NDArray, NDArray, float], tuple[float, NDArray]]
    """(x, multipliers, penalty) -> objective + penalty / 2 |max(0, multipliers / penalty - constraints)|^2, and its gradient."""
    constraints: Callable[[NDArray], NDArray]
    """x -> how far each is kept; negative: violated."""
    scale: NDArray
    """(variable variable) S of the change of variables x = x0 + S y in which steps are taken: S S^T near the inverse of the
    objective's second derivatives makes the rounds short."""


class Minimum(NamedTuple):
    """Where the rounds ended."""

    x: NDArray
    residual: float
    """Largest |min(constraint, multiplier / penalty)|: 0 if all are kept and only those that bind push."""
    slope: float
    """Length of S^T times the Lagrangian's gradient; about half its square is still to be gained."""

    @property
    def converged(self) -> bool:
        """Whether both conditions of a minimum hold closely."""
        return self.residual <= CLOSE and self.slope <= FLAT


def minimum(
    problem: Problem, start: NDArray, penalty: float = FIRST_PENALTY, rounds: int = 14, steps: int = 80
) -> Minimum:
    """The minimum to which a start leads.

    Args:
        start: may violate constraints.
        penalty: of the first round, in the unit of the objective over that of the constraints squared. A stiff one keeps to the start's side
            of what is in the way.
        rounds: at most, of minimisation and correction of the multipliers.
        steps: of L-BFGS-B in a round, at most.
    """
    x, before = np.array(start, float), np.inf
    multipliers = np.zeros_like(problem.constraints(x))
    found = Minimum(x, np.inf, np.inf)
    for _ in range(rounds):
        x, slope = _minimised(problem, x, multipliers, penalty, steps)
        kept = problem.constraints(x)
        found = Minimum(x, float(np.abs(np.minimum(kept, multipliers / penalty)).max(initial=0.0)), slope)
        if found.converged:
            break
        multipliers = np.maximum(multipliers - penalty * kept, 0)
        if found.residual > max(before / FACTOR, CLOSE):
            penalty *= FACTOR
        before = found.residual
    return found


def _minimised(problem: Problem, x: NDArray, multipliers: NDArray, penalty: float, steps: int) -> tuple[NDArray, float]:
    """The minimum of one round, and the slope that is left."""

    def value_and_slope(y: NDArray) -> tuple[float, NDArray]:
        value, slope = problem.augmented(x + problem.scale @ y, multipliers, penalty)
        return value, problem.scale.T @ slope

    options = {"maxiter": steps, "maxfun": 2 * steps, "ftol": 1e-12, "gtol": 1e-7, "maxcor": 20}
    found = minimize(value_and_slope, np.zeros_like(x), jac=True, method="L-BFGS-B", options=options)
    return x + problem.scale @ found.x, float(np.linalg.norm(found.jac))
