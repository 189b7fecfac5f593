"""A sweep as several processes: which of its chunks each of them computes."""

from dataclasses import dataclass

from hrcjax.lab.errors import UsageError


@dataclass(frozen=True)
class Shard:
    """One of several processes that share a sweep."""

    number: int
    """From 1 to `of`."""
    of: int
    kind: str = "shard"
    """What it is called: an independent "shard", or a "host" among those that run one program."""

    @property
    def name(self) -> str:
        """Name for a file."""
        return f"{self.kind}-{self.number}-of-{self.of}"

    def __str__(self) -> str:
        return f"{self.number}/{self.of}"

    def share(self, chunks: int) -> range:
        """Indices of its chunks, out of all chunks of all worlds: consecutive, so that a process builds few worlds."""
        each, rest = divmod(chunks, self.of)
        before = self.number - 1
        start = before * each + min(before, rest)
        return range(start, start + each + (before < rest))


def parse_shard(text: str, kind: str = "shard", option: str = "--shard") -> Shard:
    """`2/8`: the second of eight.

    Raises:
        UsageError: not two whole numbers, or the first is not among 1 to the second.
    """
    number, slash, of = (part.strip() for part in text.partition("/"))
    if not (slash and number.isdecimal() and of.isdecimal()):
        raise UsageError(f"{option} {text}: accepted is I/N, for example 2/8")
    shard = Shard(int(number), int(of), kind)
    if not 1 <= shard.number <= shard.of:
        raise UsageError(f"{option} {text}: the first number counts from 1 to the second")
    return shard
