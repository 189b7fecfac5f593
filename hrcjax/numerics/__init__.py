"""Norms, roots and small solves that stay finite, with finite derivatives, at their singular points."""

from hrcjax.numerics.apart import computed
from hrcjax.numerics.choice import CHOICE
from hrcjax.numerics.compiler import unrolled_options
from hrcjax.numerics.floating import require_floating
from hrcjax.numerics.ldl import ldl_factor, ldl_solve, solve_spd
from hrcjax.numerics.safe import safe_divide, safe_norm, safe_sqrt, unit

__all__ = [
    "CHOICE",
    "computed",
    "ldl_factor",
    "ldl_solve",
    "require_floating",
    "safe_divide",
    "safe_norm",
    "safe_sqrt",
    "solve_spd",
    "unit",
    "unrolled_options",
]
