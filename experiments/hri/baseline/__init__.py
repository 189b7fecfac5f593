"""The baseline of the HRI paper's experiment: OctoMap, BFMT*, time-optimal timing, and a monitor that stops and plans anew."""
