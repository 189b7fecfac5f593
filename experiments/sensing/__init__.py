"""Measures what the cell senses against the exact geometry, over whole episodes: options in `config`, one run in `run`,
the exact geometry in `truth`, the rows and their bars in `rows`."""
