"""Draws the figures of a finished sweep again."""
