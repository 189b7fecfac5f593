"""Measures the speed of the parts: against named peers, as tables, JSON and a page."""
