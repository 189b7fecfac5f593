"""The claims of the HRI paper: its abstract and project page."""

from .claim import MISSED, OPEN, PARTLY, UNDECIDABLE, Claim, Figures, said
from .rules import IMAGE_MS, by_share, when

CURVATURE = 0.1
"""Error of a curvature that is small [1]."""


def _continuous(f: Figures) -> str:
    """Values jump less than a fifth of a millimetre; slopes are not measured."""
    return PARTLY if f["map-evaluation.md:jump"] < 0.2 else MISSED


def _curved(f: Figures) -> str:
    """On every body alone, and on the map of several."""
    return by_share(
        (f[f"map-evaluation.md:{name}"] < CURVATURE for name in ("curvature_2mm.*", "map_curvature_p95")), MISSED
    )


def _avoids(f: Figures) -> str:
    """No contact with both on, contacts with both off; smoothness is not measured."""
    return PARTLY if f["avoidance.md:contact_share"] == 0 < f["avoidance.md:contact_share_leaf_off"] else MISSED


HRI = (
    Claim("abstract", "a continuous and differentiable distance field", _continuous, said("largest jump of the value {map-evaluation.md:jump} mm along lines in steps down to 8 micrometres. Jumps of the gradient are not measured; its cosine with the exact one is {map-evaluation.md:cosine.mean} on the mean"), "python -m experiments.map --evaluate"),
    Claim("abstract", "surface normals by the Hessian", when(lambda f: f["map-evaluation.md:hessian_2mm_median.worst"] < 4), said("median error {map-evaluation.md:hessian_2mm_median.worst} degrees on the worst body, 95th percentile {map-evaluation.md:hessian_2mm_p95.worst}, 2 mm of noise"), "python -m experiments.map --evaluate"),
    Claim("abstract", "curvature is readily available", _curved, said("relative error, 95th percentile, 2 mm of noise: {map-evaluation.md:curvature_2mm.*} on the worst of the bodies, each alone; {map-evaluation.md:map_curvature_p95} on a map of several, median {map-evaluation.md:map_curvature_median}"), "python -m experiments.map --evaluate"),
    Claim("framework", "points are told static, dynamic and new by two distance fields", when(lambda f: min(f["map-evaluation.md:moved_gone"], f["map-evaluation.md:moved_found"]) >= 0.95),
          said("a box moves: share of its old points gone after one image {map-evaluation.md:moved_gone}, of its new surface found {map-evaluation.md:moved_found}"), "python -m experiments.map --evaluate"),
    Claim("abstract", "efficient updates in dynamic scenes on a CPU", when(lambda f: f["benchmarks.md#map:p95_ms"] <= IMAGE_MS), said("{benchmarks.md#map:p95_ms} ms an image of 640 x 480, 95th percentile, two cores"), "python -m experiments.benchmark map"),
    Claim("abstract", "fast reactive motion by Riemannian motion policies", OPEN, said("needs the latency of one tick of one arm, beside its period of 8 ms. Measured is the throughput of a batch of 128, {benchmarks.md#sweep:ticks_per_s} ticks a second, which is another thing"), "python -m experiments.benchmark sweep"),
    Claim("abstract", "smooth collision avoidance by distance and gradient", _avoids,
          said("share of episodes with contact, obstacles that the planner does not know: {avoidance.md:contact_share}, and {avoidance.md:contact_share_leaf_off} with the policy's collision leaf and the potential's repulsion both off. How smooth the avoidance is, is not measured"), "python -m experiments.avoidance"),
    Claim("abstract", "the robot interacts safely with people", UNDECIDABLE,
          said("as a statement about people. In simulation contact while the arm moves in {avoidance.md:moving_contact_share_both} of the episodes beside them; research software, not safety-rated"), "python -m experiments.avoidance"),
    Claim("results", "mean squared jerk about 2 times lower than BFMT* with replanning on an occupancy octree", OPEN, said("needs the comparison of the reactive arm with an arm that replans by BFMT* on the same images, between the two waypoints"), "-"),
    Claim("results", "change in curvature about 3 times lower than that", OPEN, said("needs the same comparison"), "-"),
    Claim("abstract", "grasping by the field's normals in a dynamic environment", OPEN, said("needs the comparison of grasps by these normals with the bodies' own; normals are measured, see above"), "-"),
    Claim("abstract", "versatile and open, low in computation, ideal for user studies", UNDECIDABLE, said("no measure is given"), "-"),
)  # fmt: skip
