"""The HRI paper's experiment: our systems and the baseline between two waypoints, beside people who reach in."""
