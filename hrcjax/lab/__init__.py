"""Shared by all programs: errors, options, named settings, atomic file writes, progress, provenance, parameter names, tables."""
