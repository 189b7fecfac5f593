"""Calls of compiled programs on all cores: each program is small, and runs on one."""

import os
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from typing import TypeVar

_T = TypeVar("_T")


@cache
def _pool() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(os.cpu_count() or 1)


def side_by_side(f: Callable[..., _T], arguments: Iterable[tuple]) -> list[_T]:
    """What a function makes of each list of arguments, in their order."""
    return list(_pool().map(lambda given: f(*given), arguments))
