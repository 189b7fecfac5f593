"""Which chunks a shard computes, and how a user names it."""

import itertools

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hrcjax.lab.errors import UsageError
from hrcjax.sweeps.shard import Shard, parse_shard


@given(st.integers(0, 200), st.integers(1, 70))
def test_shares_hold_every_chunk_once_and_are_as_equal_as_can_be(chunks: int, of: int) -> None:
    shares = [Shard(number, of).share(chunks) for number in range(1, of + 1)]
    assert [c for share in shares for c in share] == list(range(chunks))
    assert max(map(len, shares)) - min(map(len, shares)) <= 1
    assert all(len(a) >= len(b) for a, b in itertools.pairwise(shares))  # those with nothing are the last


@pytest.mark.parametrize("text", ["2/8", " 2 / 8 "])
def test_a_shard_is_named_by_its_number_and_their_number(text: str) -> None:
    assert parse_shard(text) == Shard(2, 8)
    assert str(parse_shard(text)) == "2/8"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("0/4", "--shard 0/4: the first number counts from 1 to the second"),
        ("5/4", "--shard 5/4: the first number"),
        ("0/0", "--shard 0/0: the first number"),
        ("a/b", "--shard a/b: accepted is I/N, for example 2/8"),
        ("3", "--shard 3: accepted is"),
        ("-1/4", "--shard -1/4: accepted is"),
        ("1.5/4", "--shard 1.5/4: accepted is"),
        ("1/2/3", "--shard 1/2/3: accepted is"),
        ("/", "--shard /: accepted is"),
    ],
)
def test_other_names_are_refused(text: str, message: str) -> None:
    with pytest.raises(UsageError) as raised:
        parse_shard(text)
    assert str(raised.value).startswith(message)
