"""What all programs share: errors, options, named settings, whole-or-absent files, progress, provenance, parameter names, tables."""
