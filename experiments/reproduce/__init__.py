"""Reproduces the tables and figures of the Robotica paper, printed beside computed: printed numbers in `printed`, obstacles in
`readings`, times of the potential field in `times`, RRT* in `rrt_star`, paths in `paths` and at one speed in `fair`, the path clock
beside a person in `episode`, scores in `scores`; the pages' claims in `robotica_claims` and `hri_claims`, corrected equations in
`corrections`."""
