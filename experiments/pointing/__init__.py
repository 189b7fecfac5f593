"""Places chosen by pointing, in simulation: how far from what is meant, and which are refused."""
