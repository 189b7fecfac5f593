"""Three people and nobody in the paper's scene, three seeds each: which zeta and repulsion hold for all of them.

Command: python -m experiments.sweep --config people
Minutes on 2 cores: 12 worlds of 64 settings; about a third of the paper's sweep, and sensing for each world.
Figures: those of the paper's sweep, averaged over people and seeds.
"""

from configs.sweep_config import SweepConfig

CONFIG = SweepConfig(
    config="people",
    person=("reach_in", "pass_by", "stand_and_work", "nobody"),
    seed=(0, 1, 2),
    grid=("K_rep=log:1e-6:1e-3:8", "zeta=lin:1.5:5:8"),
)
