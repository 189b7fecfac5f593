"""Command-line options of the sweep."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from hrcjax.lab.configs import parse_config

DESCRIPTION = """Run the whole system for many settings of its parameters and store all results in one labelled file.

By default: 16 x 16 x 8 settings of K_att, K_rep and zeta in the paper's scene with a person who reaches in.
An interrupted run is resumed by the same command and gives the same results.

Examples:

  A quick test with 32 settings:
    python -m experiments.sweep --quick

  The paper's sweep, but with a recorded person in cluttered scenes of three seeds:
    python -m experiments.sweep --scene clutter --person path/to/motion.bvh --seed 0 1 2

  Your own policy, planner, field, monitor or arm, from my_cell.py in this folder:
    python -m experiments.sweep --cell my_cell:build --grid policy.stiffness=lin:10:80:8

  The planner gets its obstacles from the cameras of the set-up, and not as they are:
    python -m experiments.sweep --obstacles sensed --quick

  Other parameters: 256 Sobol samples of the field's length scale and a gain of the motion policy:
    python -m experiments.sweep --sobol 256 --grid field.length_scale=log:0.02:0.1 policy.collision.k_rep=lin:0.1:2

  What each parameter does, from a finished run: shares of settings, ranges along the grid's lines, Sobol indices, figures:
    python -m experiments.sweep --analyse runs/sweep-robotica-reach_in-... --json analysis.json

  The second of eight processes that share a sweep, on one machine or many; the last one to finish writes the results (docs/scale.md):
    python -m experiments.sweep --shard 2/8 --out /shared/run

  The second of four hosts that run one program over all their devices:
    python -m experiments.sweep --hosts 2/4 --coordinator node01:8476 --out /shared/run

  Shards or hosts without a shared folder, after each process has filled one of its own:
    python -m experiments.sweep --merge part1 part2 part3 --out run

--list shows all parameters. The last part of a name is enough if it is unique. Names are case-sensitive only where an alias
(K_rep) would otherwise match another parameter (policy.collision.k_rep); the results use lower-case names.

In a notebook: from hrcjax.sweeps.store import open_run; open_run("runs/...").score_sound.sel(zeta=5)"""


@dataclass(frozen=True)
class SweepConfig:
    """Run the whole system for many settings of its parameters and store all results in one labelled file."""

    config: str = "paper"
    """Named settings: paper, quick, people, or a TOML file of options. Other options on the command line override them."""
    cell: str = "ur5"
    """The cell: ur5, ur5e, ur5-reflected, ur5-body, or MODULE:FUNCTION that returns one with a planner, field, policy, monitor or arm of your own."""
    scene: tuple[str, ...] = ("robotica",)
    """Scenes: robotica, robotica-spheres, robotica-clearance, hri, clutter, or TOML files of named shapes (docs/formats.md), such as `experiments.task_space` makes of a recording."""
    obstacles: Literal["known", "sensed"] = "known"
    """What the planner is given: known, the exact obstacles; or sensed, what the set-up's two cameras make of them as spheres, columns and boxes (docs/task-space.md). Metrics go by the exact ones."""
    person: tuple[str, ...] = ("reach_in",)
    """People: names of motions (reach_in, pass_by, stand_and_work, reach_and_stay, nobody) or BVH files; two at once: reach_in+pass_by. A file's unit, up axis and joints are found from the body, or given after its name: walk.bvh,unit=cm,up=z,names=joints.toml."""
    seed: tuple[int, ...] = (0,)
    """Seeds of the camera's noise, of the person's variation and of cluttered scenes."""
    params: str = ""
    """Parameters in place of the cell's defaults, below those that are swept: a file of tuned parameters, the folder of a tuning, or the name of a shipped file (configs/tuned)."""
    grid: tuple[str, ...] = ("K_att=log:0.03:0.2:16", "K_rep=log:1e-6:1e-3:16", "zeta=lin:1.5:5:8")
    """Swept parameters, in place of the default ones: NAME=lin:LOW:HIGH:COUNT, NAME=log:LOW:HIGH:COUNT or NAME=V1,V2,..."""
    sobol: int = 0
    """Number of Sobol samples within the ranges of --grid; 0: full grid."""
    sobol_seed: int = 0
    """Seed of the scrambled Sobol sequence."""
    out: Path | None = None
    """Folder of the run; runs/sweep-SCENE-PERSON-FINGERPRINT if not given, so that the same command resumes."""
    quick: bool = False
    """At most 4 x 4 x 2 settings (or 16 samples)."""
    memory: float = 1000.0
    """Memory for a chunk of settings computed together [MB]; determines the chunk size."""
    backend: Literal["folded", "mjx"] | None = None
    """Dynamics of the arm: folded (fast), or mjx (MuJoCo XLA); the cell's own (folded) if not given."""
    motion: Literal["both", "path", "reactive"] | None = None
    """How the arm moves: both (a path, which the motion policies may leave), path (as planned, only its clock reacts), or reactive (policies and potential alone); the cell's own (both) if not given."""
    by: str = ""
    """Metric for ranking the settings. If not given, score_sound: success, clearance, separation, time, smoothness and energy, 0 to 100, failed runs below all others. score_overall is the Robotica paper's, in which more power scores higher."""
    best: int = 5
    """Number of settings in the table of the best ones."""
    figures: bool = True
    """Draw figures into the folder at the end."""
    overwrite: bool = False
    """Replace another run in the folder."""
    analyse: Path | None = None
    """Compute nothing: print what the swept parameters of a finished run do to its metrics, and draw it into the run's folder. Row by row: docs/sweep-analysis.md."""
    json: Path | None = None
    """With --analyse: output file {section: {row: {value, unit}}} for the section sweep_analysis; other sections in it are kept."""
    shard: str = ""
    """I/N: compute only the share of the I-th of N processes, which share --out or have a folder each. Each resumes by the same command. The last one to finish in a shared folder writes the results; they are those of one process with the same --memory."""
    merge: tuple[Path, ...] | None = None
    """Compute nothing, write the results: without folders, of the run in --out, whose options are given again; with folders, of their chunks, copied into --out, and with their options."""
    devices: int = 0
    """Number of devices of this machine, or of each of several hosts, each of which computes a chunk at a time; 0: all accelerators, or one CPU device. The results are the same."""
    hosts: str = ""
    """I/N: this is the I-th of N processes, one on each host, that run as one program over the devices of all (jax.distributed); auto: as SLURM, Open MPI, Kubernetes or a TPU pod says. All are started with the same options but I. They share --out or have a folder each, as shards, which are the better choice unless one program is wanted (docs/scale.md)."""
    coordinator: str = ""
    """With --hosts I/N: HOST:PORT at which all reach the first one, a free port of it."""
    host_timeout: int = 120
    """With --hosts: how long they wait for each other at the start, and for a sign of life of another one before they end [s]."""
    list: bool = False
    """List all parameters that can be swept and exit."""


def parse(argv: Sequence[str]) -> SweepConfig:
    """The settings from the command line.

    Raises:
        UsageError: an unknown option or config, a value of the wrong type.
        SystemExit: with status 0 after --help.
    """
    return parse_config(SweepConfig, argv, "sweep", DESCRIPTION)
