"""Every number that the Robotica paper prints in tables I to X, in its own units: centimetres, seconds."""

from typing import NamedTuple

START = (10.0, 70.0, 15.0)
"""q_start of section 3 [cm]."""
GOAL = (70.0, 30.0, 5.0)
"""q_goal of section 3 [cm]."""
OBSTACLES = ((30.0, 55.0), (25.0, 30.0), (52.0, 50.0), (55.0, 20.0))
"""x and y of O1 to O4 [cm]; their z, 20 cm, is the height of `TimeRow`."""


class TimeRow(NamedTuple):
    """One row of tables I to VII: a setting and three times to goal."""

    table: str
    number: int
    """Row in the table, from 1."""
    label: str
    """What the row's first column says."""
    iapf: float
    """Time to goal of the improved potential field [s]."""
    gda: float | None = None
    """Time to goal of gradient descent; None: not in the table [s]."""
    rrt: float | None = None
    """Time to goal of RRT*; None: not in the table [s]."""
    present: int = 4
    """Obstacles O1 to O`present` are there."""
    radius: tuple[float, float, float, float] = (3.0, 3.0, 3.0, 3.0)
    """Of O1 to O4 [cm]."""
    height: tuple[float, float, float, float] = (20.0, 20.0, 20.0, 20.0)
    """Their z [cm]."""
    k_att: float = 0.03
    k_rep: float = 0.1
    """Of the improved field [cm^2]."""
    zeta: float = 4.0
    """Safety factor; table VII calls 4 the setting with 4.70 s, which the other tables have too."""
    gda_k_att: float = 1 / 150
    gda_k_rep: float = 900.0
    """Of gradient descent [cm^4]; d0 is 4 [cm]."""

    @property
    def key(self) -> str:
        """Name of the row, such as "I.3"."""
        return f"{self.table}.{self.number}"


TIMES = (
    TimeRow("I", 1, "1 obstacle, O1", 4.7, 7.56, 5.12, present=1),
    TimeRow("I", 2, "2 obstacles, O1-2", 4.7, 7.57, 5.81, present=2),
    TimeRow("I", 3, "3 obstacles, O1-3", 4.7, 7.51, 5.72, present=3),
    TimeRow("I", 4, "4 obstacles, O1-4", 4.7, 7.62, 6.2, present=4),
    TimeRow("II", 1, "2 cm", 4.68, 7.65, 5.88, radius=(2.0, 2.0, 2.0, 2.0)),
    TimeRow("II", 2, "2.5 cm", 4.69, 7.61, 6.08, radius=(2.5, 2.5, 2.5, 2.5)),
    TimeRow("II", 3, "3.0 cm", 4.7, 7.70, 6.20),
    TimeRow("II", 4, "3.5 cm", 4.72, 7.74, 6.15, radius=(3.5, 3.5, 3.5, 3.5)),
    TimeRow("III", 1, "2, 2.5, 3, 3.5 cm", 4.69, 7.54, 6.14, radius=(2.0, 2.5, 3.0, 3.5)),
    TimeRow("III", 2, "2.5, 2, 3, 3.5 cm", 4.68, 7.58, 6.29, radius=(2.5, 2.0, 3.0, 3.5)),
    TimeRow("III", 3, "3, 3.5, 2, 2.5 cm", 4.72, 7.57, 5.77, radius=(3.0, 3.5, 2.0, 2.5)),
    TimeRow("III", 4, "3.5, 3, 2.5, 2 cm", 4.70, 7.74, 5.93, radius=(3.5, 3.0, 2.5, 2.0)),
    TimeRow("IV", 1, "heights 25, 20, 18, 15 cm", 4.7, 7.61, 5.57, height=(25.0, 20.0, 18.0, 15.0)),
    TimeRow("IV", 2, "heights 20, 25, 18, 15 cm", 4.7, 7.61, 5.34, height=(20.0, 25.0, 18.0, 15.0)),
    TimeRow("IV", 3, "heights 18, 15, 20, 25 cm", 4.7, 7.61, 6.58, height=(18.0, 15.0, 20.0, 25.0)),
    TimeRow("IV", 4, "heights 15, 18, 25, 20 cm", 4.7, 7.61, 7.32, height=(15.0, 18.0, 25.0, 20.0)),
    TimeRow("V", 1, "K_att 0.03; GDA 1/300", 4.7, 7.48, gda_k_att=1 / 300, gda_k_rep=600.0),
    TimeRow("V", 2, "K_att 0.04; GDA 1/320", 3.51, 7.52, k_att=0.04, gda_k_att=1 / 320, gda_k_rep=600.0),
    TimeRow("V", 3, "K_att 0.05; GDA 1/340", 2.79, 7.56, k_att=0.05, gda_k_att=1 / 340, gda_k_rep=600.0),
    TimeRow("VI", 1, "K_rep 0.1; GDA 600", 3.51, 7.48, k_att=0.04, gda_k_att=1 / 300, gda_k_rep=600.0),
    TimeRow("VI", 2, "K_rep 0.2; GDA 650", 3.51, 7.51, k_att=0.04, k_rep=0.2, gda_k_att=1 / 300, gda_k_rep=650.0),
    TimeRow("VI", 3, "K_rep 0.3; GDA 700", 3.52, 7.55, k_att=0.04, k_rep=0.3, gda_k_att=1 / 300, gda_k_rep=700.0),
    TimeRow("VII", 1, "zeta 4", 4.70),
    TimeRow("VII", 2, "zeta 5", 4.72, zeta=5.0),
    TimeRow("VII", 3, "zeta 6", 4.74, zeta=6.0),
)

TIMES_CAPTION = {
    "I": "Varying number of obstacles",
    "II": "Varying size of obstacles",
    "III": "Multivariate scenario: sizes of O1 to O4",
    "IV": "Varying height of O1 to O4",
    "V": "Varying K (attractive); K_rep 0.1, gradient descent 600",
    "VI": "Varying K (repulsive); K_att 0.04, gradient descent 1/300",
    "VII": "Varying safety factor",
}


class PathRow(NamedTuple):
    """One row of table VIII."""

    name: str
    length: float
    """[cm]."""
    bending: float
    """Bending energy [1/cm]."""
    score: float
    """Normalised score, the lower the better [1]."""


PATHS = (
    PathRow("BC-1", 78.31, 0.05, 0.5),
    PathRow("BC-2", 79.87, 0.03, 0.54),
    PathRow("Optimal Path", 78.64, 0.03, 0.12),
)
"""Table VIII. Its lengths and bending energies are rounded to 0.01."""

FORMULAS = {
    "task time": ("E = T_ideal / T_total", "100 T_ideal / T_total"),
    "power efficiency": ("W_i = JE_i JV_i, TW = sum W_i, TW / max TW", "100 mean(sum |tau_i qd_i|) / max"),
    "trajectory smoothness": ("S_i = sum |JA_i(t) - JA_i(t-1)|, (S_i - min) * 99 + 13, averaged", "the same with * 99 + 1: \"13\" is 1 and a list number"),
    "joint smoothness": ("omega_i = theta_i / t, averaged", "100 mean(omega) / max(omega)"),
    "safe navigation": ("100 - (% time in unsafe distances)", "the same, unsafe below S_p(0)"),
    "obstacle proximity": ("OPM_i = PH_i + sum of four obstacle distances", "100 mean / max"),
    "time to collision": ("distance / (V_r + V_h)", "the same, capped at a horizon of 5 s, which the paper does not give"),
}  # fmt: skip
"""Table IX: measure -> formula as printed, reading."""

SCORES = {
    "Task Completion time": (100.0, 67.66),
    "Power Efficiency": (50.67, 48.43),
    "Trajectory Smoothness": (47.41, 47.31),
    "Joint Smoothness": (53.14, 53.14),
    "Safe Navigational Efficiency": (100.0, 73.51),
    "Obstacle Proximity": (69.07, 61.20),
    "Collision Risk Metric": (40.18, 44.04),
}
"""Table X: measure -> score without zones, with zones."""
SAFETY_PRINTED, EFFICIENCY_PRINTED, RELATIVE_PRINTED = 61.0, 55.0, 83.87
"""Section 5: scores of the run with zones [%], and its overall score relative to that without."""

LEADS = {
    "I": ("Case 1", 37.0, 9.0),
    "II": ("Case 2", 35.0, 10.0),
    "III": ("Case 3", 39.0, 4.0),
    "IV": ("Case 4", 37.0, 21.0),
}
"""Section 3: table -> case, lead of the improved field over gradient descent and over RRT* as the text says [%]."""
