"""The paper's scene with a person who reaches in: 16 x 16 x 8 settings of K_att, K_rep and zeta.

Command: python -m experiments.sweep
Minutes on 2 cores: about 3, a third of it compilation the first time; the progress bar shows the time left.
Figures: the score and its parts over K_att x K_rep for each zeta; the Pareto front of length, bending energy and
clearance; the best and the worst path with obstacles and the person; zones, separation and speed over time.
"""

from configs.sweep_config import SweepConfig

CONFIG = SweepConfig(config="paper")
