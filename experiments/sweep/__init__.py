"""Runs the whole system for many settings of its parameters: options in `config`, one run in `run`, figures in
`hrcjax.sweeps.figures`."""
