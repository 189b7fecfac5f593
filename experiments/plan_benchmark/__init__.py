"""Measures the planner of the whole arm on published problems: options in `config`, problems in `problems`, the exact
collision check in `checker`, the stages of guesses in `solve`, times in `speed`, the rows in `rows`."""
