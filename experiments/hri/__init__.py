"""The HRI paper's experiment: a robot cycles between two waypoints while a person puts an arm in its way."""
