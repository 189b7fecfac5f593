"""The claims of the HRI paper: its abstract and project page."""

from .claim import OPEN, REPRODUCED, UNDECIDABLE, Claim, said

HRI = (
    Claim("abstract", "a continuous and differentiable distance field", REPRODUCED, said("largest jump {map-evaluation.md:jump} mm along lines in steps down to 8 micrometres"), "python -m experiments.map --evaluate"),
    Claim("abstract", "surface normals by the Hessian", REPRODUCED, said("median error {map-evaluation.md:hessian_2mm_median.worst} degrees on the worst body, 2 mm of noise"), "python -m experiments.map --evaluate"),
    Claim("abstract", "curvature is readily available", REPRODUCED, said("error {map-evaluation.md:curvature_2mm.sphere_100} of the curvature of a ball of 10 cm, 95th percentile, 2 mm of noise"), "python -m experiments.map --evaluate"),
    Claim("framework", "points are told static, dynamic and new by two distance fields", REPRODUCED,
          said("a box moves: share of its old points gone after one image {map-evaluation.md:moved_gone}, of its new surface found {map-evaluation.md:moved_found}"), "python -m experiments.map --evaluate"),
    Claim("abstract", "efficient updates in dynamic scenes on a CPU", REPRODUCED, said("{benchmarks.md:p95_ms} ms an image of 640 x 480, 95th percentile, two cores"), "python -m experiments.benchmark map"),
    Claim("abstract", "fast reactive motion by Riemannian motion policies", REPRODUCED, said("{benchmarks.md#sweep:ticks_per_s} ticks of 8 ms a second in a batch of 128"), "python -m experiments.benchmark sweep"),
    Claim("abstract", "smooth collision avoidance by distance and gradient", REPRODUCED,
          said("contacts in {avoidance.md:contact_share} of episodes with obstacles that the planner does not know, {avoidance.md:contact_share_leaf_off} without the policy's collision leaf"), "python -m experiments.avoidance"),
    Claim("abstract", "the robot interacts safely with people", UNDECIDABLE,
          said("as a statement about people. In simulation contact while the arm moves in {avoidance.md:moving_contact_share_both} of the episodes beside them; research software, not safety-rated"), "python -m experiments.avoidance"),
    Claim("results", "mean squared jerk about 2 times lower than BFMT* with replanning on an occupancy octree", OPEN, said("needs the comparison of the reactive arm with an arm that replans by BFMT* on the same images, between the two waypoints"), "-"),
    Claim("results", "change in curvature about 3 times lower than that", OPEN, said("needs the same comparison"), "-"),
    Claim("abstract", "grasping by the field's normals in a dynamic environment", OPEN, said("needs the comparison of grasps by these normals with the bodies' own; normals are measured, see above"), "-"),
    Claim("abstract", "versatile and open, low in computation, ideal for user studies", UNDECIDABLE, said("no measure is given"), "-"),
)  # fmt: skip
