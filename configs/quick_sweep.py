"""The paper's sweep in small: 4 x 4 x 2 settings, to see that everything works.

Command: python -m experiments.sweep --config quick (the same as --quick)
Minutes on 2 cores: about 1, most of it compilation.
Figures: those of the paper's sweep with coarse heat maps.
"""

from configs.sweep_config import SweepConfig

CONFIG = SweepConfig(config="quick", quick=True)
