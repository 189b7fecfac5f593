"""Figures of a run, from its stored cases: the content of the paper's figures 6 to 11 and 13 to 17."""

from collections.abc import Sequence
from pathlib import Path

from matplotlib.figure import Figure

from hrcjax.lab.atomic import replace_file

from .field_figure import field_figure
from .motion_figures import motion_figure, zones_figure
from .path_figures import optimised_figure, paths_figure, variants_figure
from .rows import Cases, told
from .score_figure import scores_figure
from .time_figures import speed_figure, times_figure


def draw(folder: Path, cases: Cases, readings: Sequence[str]) -> Sequence[str]:
    """Draws all figures into a folder.

    Returns:
        name and content of each figure.
    """
    folder.mkdir(exist_ok=True)
    reading, said = told(readings), []

    def keep(name: str, figure: Figure, text: str) -> None:
        replace_file(folder / name, lambda there: figure.savefig(there, dpi=130, format="png"))
        said.append(f"`{name}`: {text}")

    keep("times.png", times_figure(cases, readings), "printed and computed times of the improved field, row by row")
    keep(
        "speed.png",
        speed_figure(cases, readings),
        "printed times beside those at one speed (the paper's figure 9), and RRT* over its iterations",
    )
    keep(
        "paths.png",
        paths_figure(cases, readings),
        "paths of every planner from above, in every reading (figures 6 to 8)",
    )
    keep(
        "variants.png",
        variants_figure(cases, reading),
        "the improved field's path under each table's variations (figures 6 to 8, 10, 11)",
    )
    keep(
        "field.png",
        field_figure(cases, reading),
        "potential, streamlines and path: improved field of little and much repulsion, gradient descent (figure 10)",
    )
    keep(
        "optimised.png",
        optimised_figure(cases, reading),
        "the descent and planned paths, with their squared curvature (figure 13)",
    )
    keep(
        "scores.png",
        scores_figure(cases, reading),
        "the score of table VIII over length and bending energy (figure 14)",
    )
    keep(
        "motion.png",
        motion_figure(cases["episode"]),
        "tool and person over time, without and with zones (figures 15 to 17)",
    )
    keep("zones.png", zones_figure(cases["episode"]), "zones, distance and speed of both runs")
    return said
