"""Safety measured: whether the arm can always stop, violations beside people, what safety costs."""
