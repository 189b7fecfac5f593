"""Command-line options of the program."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

from hrcjax.lab.configs import parse_config

DESCRIPTION = """Measure the planners. Two spaces:

  point   planners of a point in seeded scenes with obstacles on the straight line: gradient descent, plain and improved
          potential field, the optimiser after one descent and from many starts, and OMPL's RRT*, Informed RRT* and BFMT*;
          one check, one clearance, one law of time for all; and the optimiser's cost against an augmented Lagrangian's
  arm     the planner of the whole arm: problems of a UR5 among boxes, each path accepted by an exact collision check at
          steps of 2 degrees, and the speed of plans in the Robotica paper's scene

OMPL and toppra come with: pip install 'hrcjax[baselines]'. Without them their planners and times are left out. Every scene and
planner is stored as it comes, and so are the arm's rows: an interrupted run is resumed by the same command.

Examples:

  A few scenes and problems:
    python -m experiments.plan_benchmark --quick

  The comparison alone, with two planners:
    python -m experiments.plan_benchmark --space point --planners multi_start bfmt_star

  300 problems of the arm drawn evenly:
    python -m experiments.plan_benchmark --space arm --count 300

  All, with rows in a file and a page:
    python -m experiments.plan_benchmark --json plan.json --page docs/plan-benchmark.md"""


@dataclass(frozen=True)
class PlanBenchmarkConfig:
    """Measure the planners of a point and of the whole arm."""

    config: str = "standard"
    """Named settings: standard, or a TOML file of options. Other options on the command line override them."""
    space: Literal["both", "point", "arm"] = "both"
    """What is planned for: point, arm, or both."""
    scenes: int = 200
    """Scenes of the comparison in point space."""
    seed: int = 0
    """Seed of the first scene; the next ones follow."""
    unseen: int = 60
    """Scenes of other seeds, from 5000 on, for which shares against the best baseline alone are given. 0: none."""
    planners: tuple[str, ...] = ()
    """Planners of a point; none named: all. gradient_descent, plain_apf, iapf, iapf_optimised, multi_start, multi_start_slack, rrt_star, informed_rrt_star, bfmt_star."""
    budget: float = 1.0
    """Time of each of OMPL's planners for a scene, simplification included [s]."""
    lagrange: int = 50
    """Scenes with three times the clearance, in which the optimiser's paths are held against an augmented Lagrangian's. 0: none."""
    out: Path | None = None
    """Folder of the run; runs/plan_benchmark-FINGERPRINT if not given, so that the same command resumes."""
    figures: bool = True
    """Draw figures of the comparison into the folder at the end."""
    overwrite: bool = False
    """Replace another run in the folder."""
    problems: Path = Path("../shared/data/planning/ur5s_6_3000.npz")
    """Problems of the arm: start, goal, box_center, box_half_extents, n_boxes, and reference paths."""
    count: int = 0
    """Problems to take, drawn evenly from the file. 0: all."""
    peers: int = 300
    """Problems, drawn evenly from those, that OMPL's RRTConnect and BFMT* solve too. 0: none."""
    processes: int = 0
    """Processes that solve the arm's problems side by side. 0: one for each core, of at least 32 problems each."""
    families: int = 30
    """Problems of each other family: shelves, tables, cages, spheres, turned boxes, points. 0: none."""
    settings: int = 128
    """Settings of K_att, K_rep and zeta for which the arm is planned at once in the Robotica paper's scene. 0: none."""
    quick: bool = False
    """At most 10 scenes, 4 of other seeds and 2 for the augmented Lagrangian, with 0.2 s for OMPL's planners; 50 problems, 10 of them by OMPL too, 3 of each family, 16 settings."""
    json: Path | None = None
    """Output file {"plan_benchmark": {row: {value, unit}}}; other sections, and the rows of the other space, are kept."""
    page: Path | None = None
    """Output file for a Markdown page of the rows, with what is measured."""


def reduced(config: PlanBenchmarkConfig) -> PlanBenchmarkConfig:
    """The options of a quick run."""
    count = min(config.count or 50, 50)
    return replace(
        config, scenes=min(config.scenes, 10), unseen=min(config.unseen, 4), lagrange=min(config.lagrange, 2), budget=min(config.budget, 0.2), count=count, settings=min(config.settings, 16), peers=min(config.peers, 10), families=min(config.families, 3)
    )  # fmt: skip


def parse(argv: Sequence[str]) -> PlanBenchmarkConfig:
    """The settings from the command line.

    Raises:
        UsageError: an unknown option or config, a value of the wrong type.
        SystemExit: with status 0 after --help.
    """
    config = parse_config(PlanBenchmarkConfig, argv, "plan_benchmark", DESCRIPTION)
    return reduced(config) if config.quick else config
