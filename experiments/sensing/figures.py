"""Figures of a run."""


def draw(store, runner, config) -> list[str]:
    return []
