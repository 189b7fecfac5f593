"""Reproduces the tables and figures of the Robotica paper, printed beside computed: printed numbers in `printed`, obstacles in
`readings`, times of the potential field in `times`, RRT* in `rrt_star`, paths in `paths`, the path clock beside a person in
`episode`, scores in `scores`, claims of both papers in `claims`, corrected equations in `corrections`."""
