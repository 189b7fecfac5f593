"""How large a share may still be when so many of so many were counted."""

from scipy.stats import beta


def upper_limit(found: int, of: int, confidence: float = 0.95) -> float:
    """One-sided upper limit of a share (Clopper and Pearson 1934); about 3 / of when none was found [1]."""
    return 1.0 if found >= of else float(beta.ppf(confidence, found + 1, of - found))
