"""What a sweep runs: a function of settings and a world, and the names of its outputs."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal, NamedTuple

NOT_FINITE = -1
"""Status of a setting with a result that is not finite."""


class Metric(NamedTuple):
    """One number per setting."""

    unit: str
    better: Literal["low", "high", ""]
    """Whether low or high values are better; empty: neither."""
    description: str


class Trace(NamedTuple):
    """An array per setting (or per world): its dims without the leading `setting`."""

    dims: tuple[str, ...]
    unit: str
    description: str


@dataclass(frozen=True)
class Sweepable:
    """A function of settings and worlds with everything needed to run, store, rank and draw a sweep of it."""

    params: Any
    """The defaults: a pytree whose leaves are Python floats."""
    evaluate: Callable[[Any, Any], Mapping[str, Any]]
    """(params, world) -> metrics (setting,), traces (setting, ...) and "status" (setting,). Leaves of params that are
    swept have the shape (setting,); the others are scalars, shared by all settings."""
    worlds: Sequence[tuple[Mapping[str, Any], Callable[[], Any]]]
    """({"scene", "person", "seed"}, function that builds the world): the full product, the last label fastest."""
    metrics: Mapping[str, Metric]
    traces: Mapping[str, Trace]
    bytes_per_setting: int = 1_000_000
    """Memory per setting of a chunk while it runs [bytes]."""
    aliases: Mapping[str, str] = field(default_factory=dict)
    """Short names of parameters: {"k_att": "potential.k_att"}."""
    domains: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    """Smallest and largest accepted value of a parameter by dotted name, both inclusive."""
    rank: str = "score"
    """The metric for ranking the settings."""
    trade_off: tuple[str, ...] = ("length", "bending_energy", "clearance")
    """The metrics of the Pareto figure."""
    statuses: Mapping[int, str] = field(default_factory=lambda: {0: "ok"})
    """Meaning of each status; 0 is success."""
    coords: Mapping[str, tuple[Any, str, str]] = field(default_factory=dict)
    """Values, unit and description of dims of traces, for example time."""
    describe: Callable[[Any], Mapping[str, Any]] | None = None
    """World -> the arrays that figures need; stored once per world."""
    described: Mapping[str, Trace] = field(default_factory=dict)
    """Dims, unit and description of the arrays of `describe`."""
    notes: Sequence[str] = ()
    """Messages for the user before the run, one line each."""
    identity: str | None = None
    """Identifies everything that `evaluate` closes over, so that the traced program can be cached. None: no cache."""
    code: str = ""
    """Digest of code and files outside of the project that affect results; a run resumes only if they are unchanged."""
    open_ended: frozenset[str] = frozenset()
    """Outputs in which infinity or NaN is valid, for example a separation without a person."""

    def __post_init__(self) -> None:
        for name, metric in self.metrics.items():
            if metric[1] not in ("low", "high", ""):
                raise ValueError(f"metric {name}: better is {metric[1]!r}, accepted: 'low', 'high', ''")
        if self.rank not in self.metrics:
            raise ValueError(f"rank {self.rank!r} is no metric; metrics: {', '.join(self.metrics)}")
