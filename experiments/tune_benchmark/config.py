"""Command-line options of the program."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from hrcjax.lab.configs import parse_config

DESCRIPTION = """Race methods that tune parameters through the closed loop, each with the same compute, in worlds that none has seen.

  defaults       the parameters as they come; no compute
  gradient       Adam on the smooth loss by the gradient of whole episodes, as experiments.tune
  quasi_newton   L-BFGS-B on the same loss and gradients, from several starts, again from new ones where it has converged
  random         settings uniform within the bounds
  cma_es         CMA-ES in the coordinates without bounds
  sweep          the default grid of experiments.sweep over K_att, K_rep and zeta alone

Compute is counted in forward episodes; the gradient of one counts as often as it takes longer, measured in the same run. random,
cma_es and sweep optimise the true score. The seeds of a method run side by side and share calls. Every batch is stored as it comes: an interrupted run is resumed by the same command.

Examples:

  Does it run? Short episodes, two worlds, a few episodes for each method:
    python -m experiments.tune_benchmark --quick

  Twice the compute, five seeds, and the page:
    python -m experiments.tune_benchmark --share 0.2 --seeds-of-methods 0 1 2 3 4 --page docs/tune-benchmark.md

  Two methods with 200 episodes each:
    python -m experiments.tune_benchmark --methods defaults gradient cma_es --budget 200"""

METHODS = ("defaults", "gradient", "quasi_newton", "random", "cma_es", "sweep")
SMOOTH = {"random": "random_smooth", "cma_es": "cma_smooth"}
"""Methods that --smooth adds: the same on the smooth loss."""
BY_GRADIENT = ("gradient", "quasi_newton")


@dataclass(frozen=True)
class TuneBenchmarkConfig:
    """Race methods that tune parameters, each with the same compute."""

    config: str = "standard"
    """Named settings: standard, or a TOML file of options. Other options on the command line override them."""
    cell: str = "ur5"
    """The cell: ur5, ur5e, ur5-reflected, ur5-body, or MODULE:FUNCTION that returns one of your own."""
    params: tuple[str, ...] = (
        "K_att=0.01:0.2", "K_rep=1e-6:1e-3", "zeta=1.2:5", "plan.omega2=1e-3:0.1", "plan.omega3=0.1:10", "policy.target.kp=2:50",
        "policy.collision.k_rep=1:30", "policy.collision.k_damp=1:40", "policy.damping.k=0.2:5", "motion.clock.jerk=3:50",
    )  # fmt: skip
    """Parameters: NAME=LOW:HIGH or NAME=LOW:HIGH:START, as in experiments.tune."""
    frozen: tuple[str, ...] = ()
    """Parameters that are left out of those chosen."""
    loss: tuple[str, ...] = ("sound=1", "progress=0.5")
    """Terms of the smooth loss of the methods by gradient: NAME=WEIGHT, as in experiments.tune."""
    scenes: tuple[str, ...] = ("robotica", "hri")
    """Training scenes: robotica, robotica-spheres, robotica-clearance, hri, clutter."""
    people: tuple[str, ...] = ("reach_in", "pass_by")
    """Training people: names of motions, or BVH files."""
    seeds: tuple[int, ...] = (0,)
    """Training seeds of noise, people and cluttered scenes."""
    held_out_scenes: tuple[str, ...] = ("robotica", "hri", "clutter")
    """Scenes of the worlds that are held out."""
    held_out_people: tuple[str, ...] = ("reach_in", "pass_by", "stand_and_work", "reach_and_stay")
    """People held out."""
    held_out_seeds: tuple[int, ...] = (100, 101)
    """Seeds held out."""
    methods: tuple[str, ...] = METHODS
    """Methods: defaults, gradient, quasi_newton, random, cma_es, sweep."""
    seeds_of_methods: tuple[int, ...] = (0, 1, 2)
    """Seeds of the starts and draws of each method."""
    smooth: bool = False
    """Adds random search and CMA-ES on the smooth loss."""
    grid: tuple[str, ...] = ("K_att=log:0.03:0.2:16", "K_rep=log:1e-6:1e-3:16", "zeta=lin:1.5:5:8")
    """The sweep: NAME=lin:LOW:HIGH:COUNT, NAME=log:LOW:HIGH:COUNT or NAME=V1,V2,..., within the bounds of --params."""
    share: float = 0.1
    """Compute of each other method, as a share of the sweep's [1]."""
    budget: int = 0
    """Compute of each method but the sweep [forward episodes]; 0: by --share."""
    ratio: float = 0.0
    """Forward episodes that a value and gradient counts as [1]; 0: measured in this run."""
    rate: float = 0.1
    """Rate of Adam: about the largest step of a coordinate [1]."""
    clip: float = 1.0
    """Largest norm of a gradient in Adam; a longer one is shortened to it [1]."""
    starts: int = 2
    """Starts of the methods by gradient, side by side: the defaults, and others drawn within the bounds."""
    choices: int = 8
    """Candidates of a method on the smooth loss that it compares by the true score at its end, from its own compute."""
    population: int = 0
    """Settings in a generation of CMA-ES; 0: its own rule, 4 + 3 ln(parameters)."""
    at_once: int = 32
    """Settings in one call of the forward program, in one world, of all seeds of a method together; fewer are filled up."""
    seed: int = 0
    """Seed of the intervals."""
    quick: bool = False
    """Episodes of 3 s, two worlds to train and two held out, one seed, 24 episodes a method, a sweep of 32: does it run?"""
    out: Path | None = None
    """Folder of the run; runs/tune_benchmark-FINGERPRINT if not given, so that the same command resumes."""
    json: Path | None = None
    """Output file {section: {row: {value, unit}}}; other sections in it are kept."""
    page: Path | None = None
    """Output file for a Markdown page of the results."""
    figures: bool = True
    """Draw figures into the folder at the end."""
    overwrite: bool = False
    """Replace another run in the folder."""

    @property
    def raced(self) -> tuple[str, ...]:
        """All methods of the run, in order."""
        return self.methods + tuple(more for name, more in SMOOTH.items() if self.smooth and name in self.methods)


def reduced(config: TuneBenchmarkConfig) -> TuneBenchmarkConfig:
    """The options of a quick run."""
    return replace(
        config, scenes=config.scenes[:1], people=config.people[:2], seeds=config.seeds[:1], held_out_scenes=config.held_out_scenes[:1],
        held_out_people=config.held_out_people[:2], held_out_seeds=config.held_out_seeds[:1],
        seeds_of_methods=config.seeds_of_methods[:1], budget=config.budget or 24, starts=1, choices=2,
        at_once=min(config.at_once, 8),
    )  # fmt: skip


def parse(argv: Sequence[str]) -> TuneBenchmarkConfig:
    """The settings from the command line.

    Raises:
        UsageError: an unknown option or config, a value of the wrong type.
        SystemExit: with status 0 after --help.
    """
    config = parse_config(TuneBenchmarkConfig, argv, "tune_benchmark", DESCRIPTION)
    return reduced(config) if config.quick else config
