"""A sweep as a library: its settings, the engine that runs them, the folder of a run, the labelled results, figures."""

from hrcjax.sweeps.store import newest_run, open_run

__all__ = ["newest_run", "open_run"]
