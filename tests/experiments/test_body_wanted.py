"""Which cases the program asks for, by person, tracker and seed."""

from experiments.body.config import BodyConfig
from experiments.body.run import wanted


def test_everybody_comes_once_with_each_seed_and_other_trackers_with_the_first() -> None:
    config = BodyConfig(
        people=("reach_in", "pass_by"), seed=3, seeds=2, variants=("full", "cold"), compared=1, seconds=2.0
    )
    found = wanted(config)
    files = [file for file, _ in found.values()]
    assert len(set(files)) == len(files) == 2 * 2 + 2 * 2 + 1  # loop, track, and the first person cold
    assert [name for name in found if name.startswith("cold/")] == ["cold/reach_in"]
    again = wanted(BodyConfig(people=("reach_in",), parts=("loop",), seed=4, seconds=2.0))
    assert again["loop/reach_in"][0] == found["loop/reach_in, seed 4"][0]  # a case is that of its own seed
