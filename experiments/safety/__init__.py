"""Measures safety beside people and what it costs: ways to stop, violations, zones, the path, episodes by chance."""
