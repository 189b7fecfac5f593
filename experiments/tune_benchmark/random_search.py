"""Settings uniform within the bounds, by the logarithm where both are positive; the defaults are the first."""

from .account import Account
from .config import TuneBenchmarkConfig
from .starts import starting


def random_search(account: Account, config: TuneBenchmarkConfig, seed: int) -> None:
    """Draws until the budget is used."""
    done = 0
    while count := min(config.at_once, account.affordable()):
        account.evaluate(starting(account.race.problem, seed, done, count, edge=0.0))
        done += count
