"""Random chains as MuJoCo models."""

import mujoco
import numpy as np


def random_model(joints: int, seed: int) -> mujoco.MjModel:
    """A chain with everything askew: anchors, axes, frames, inertias, references; a welded body, a double hinge."""
    rng = np.random.default_rng(seed)
    spec = mujoco.MjSpec()
    spec.compiler.degree = False
    spec.option.gravity = rng.normal(size=3) * 5
    body = spec.worldbody.add_body(pos=rng.normal(size=3) * 0.3, quat=rng.normal(size=4))  # welded to the world
    made = 0
    while made < joints:
        body = body.add_body(pos=rng.normal(size=3) * 0.3, quat=rng.normal(size=4))
        spread = np.abs(rng.normal(size=3)) * 0.02 + 0.01
        body.explicitinertial = True
        body.mass = 0.5 + rng.uniform()
        body.ipos = rng.normal(size=3) * 0.1
        body.iquat = rng.normal(size=4)
        body.inertia = [spread[1] + spread[2], spread[0] + spread[2], spread[0] + spread[1]]
        for _ in range(2 if made == 1 and joints > 3 else 1):
            joint = body.add_joint(
                type=mujoco.mjtJoint.mjJNT_HINGE, axis=rng.normal(size=3), pos=rng.normal(size=3) * 0.1
            )
            joint.damping = [rng.uniform() * 2, 0.0, 0.0]
            joint.armature = rng.uniform() * 0.05
            joint.ref = rng.normal()
            made += 1
        if made == 2:
            welded = body.add_body(pos=rng.normal(size=3) * 0.2, quat=rng.normal(size=4))
            welded.explicitinertial = True
            welded.mass, welded.ipos, welded.iquat, welded.inertia = (
                0.4,
                [0.1, 0.0, 0.05],
                [1.0, 0.2, 0.0, 0.3],
                [0.02, 0.03, 0.025],
            )
            body = welded
    return spec.compile()
