"""Named cells: parts with defaults, domains and metrics, ready to be swept."""
