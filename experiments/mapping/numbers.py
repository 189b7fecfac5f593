"""The numbers of parameters."""

import dataclasses
from typing import Any


def numbers_of(params: Any) -> dict[str, float]:
    """Name -> value of a dataclass whose fields are single numbers."""
    return {field.name: float(getattr(params, field.name)) for field in dataclasses.fields(params)}
