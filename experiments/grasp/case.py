"""One object in one pose: seen, grasps of all ways, lifts. As arrays."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from hrcjax.grasp.gripper import Gripper
from hrcjax.grasp.params import GraspParams
from hrcjax.grasp.reach import arm_with_gripper
from hrcjax.robot import Arm, load_arm

from .hand_looks import look_reached
from .lift import Lifted, lift
from .look import STATIONARY, TARGET_HEIGHT, cameras, exact_surface, hand_eyes, look, stacked
from .objects import NAMES, shape_named
from .perceive import perceive
from .pipeline import Planned, plan, reached
from .scene import draw_poses, make_scene

TRIED = 16
"""Grasps, best first, of which the first that the arm reaches is taken."""
KEPT = 2000
"""Points of the exact surface that are stored."""
NOTHING = Lifted(False, 0.0, False, 0.0, 0.0)


@dataclass(frozen=True)
class Bench:
    """What all objects share."""

    frames: int
    hand: bool
    frictions: tuple[float, ...]
    """Of the pads [1]."""
    gripper: Gripper
    arm: Arm
    params: GraspParams

    def case(self, name: str, seed: int, number: int) -> Mapping[str, Any]:
        """One object.

        Args:
            name: of the shape.
            seed: of poses and noise.
            number: of the pose.
        """
        shape, index = shape_named(name), NAMES.index(name)
        pose = draw_poses([seed, index], number + 1)[number]
        scene = make_scene(shape, pose, self.gripper)
        places = cameras(pose[0])
        looks = [look(scene, camera) for camera in (places if self.hand else places[: len(STATIONARY)])]
        surface, normals = exact_surface(looks)
        key = jax.random.fold_in(jax.random.key(seed), 1000 * index + number)
        seen = perceive(*stacked(looks, key), self.frames)
        found: dict[str, Any] = {
            "place": pose[0], "yaw": pose[1], "rest": pose[2], "centre": scene.centre(),
            "points": seen.cloud.points, "mask": seen.cloud.mask, "more": seen.more,
        }  # fmt: skip
        few = np.random.default_rng(0).permutation(len(surface))[:KEPT]
        found |= {"surface": surface[few].astype(np.float32), "surface_normal": normals[few].astype(np.float32)}
        if self.hand:
            at = jnp.asarray([*pose[0], TARGET_HEIGHT], jnp.float32)
            eyes = [jnp.asarray(eye, jnp.float32) for eye in hand_eyes(np.asarray(at, float))]
            found["looks_reached"] = np.array([bool(look_reached(self.arm, eye, at)) for eye in eyes])
        tree = KDTree(surface)
        for way, planned in plan(seen, self.gripper, self.params).items():
            own = self._way(planned, tree, normals, shape, pose)
            found |= {f"{way}_{key}": value for key, value in own.items()}
        return found

    def _way(self, planned: Planned, tree: KDTree, normals: NDArray, shape: Any, pose: Any) -> dict[str, Any]:
        """Errors of the normals, the grasps, and what became of the first that is reached."""
        contacts, grasps = jax.tree.map(np.asarray, planned)
        _, nearest = tree.query(contacts.points)
        exact = normals[nearest]
        error = _angle(contacts.normals, exact)
        first = jax.tree.map(lambda leaf: jnp.asarray(leaf[:TRIED]), grasps)
        can = np.asarray(reached(self.arm, first, self.params.approach).ok) & grasps.mask[:TRIED]
        taken = int(np.argmax(can)) if can.any() else -1
        lifts, true_angle = [NOTHING] * len(self.frictions), np.nan
        if taken >= 0:
            R, p = grasps.R[taken].astype(float), grasps.p[taken].astype(float)
            touched = exact[grasps.contact[taken]]
            true_angle = float(np.max(np.arccos(np.clip(np.abs(touched @ R[:, 1]), 0, 1))))
            lifts = [
                lift(make_scene(shape, pose, self.gripper, mu), R, p, float(grasps.opening[taken]))
                for mu in self.frictions
            ]
        return {
            "normals": contacts.normals, "planarity": contacts.planarity, "ok": contacts.mask, "error": error,
            "R": grasps.R, "p": grasps.p, "width": grasps.width, "opening": grasps.opening, "score": grasps.score,
            "contact": grasps.contact, "free": grasps.mask, "reached": can, "taken": taken, "true_angle": true_angle,
            **{key: np.array([asdict(one)[key] for one in lifts]) for key in asdict(NOTHING)},
        }  # fmt: skip


def make_bench(frames: int, hand: bool, frictions: tuple[float, ...]) -> Bench:
    """A UR5 with the default gripper."""
    gripper = Gripper()
    return Bench(frames, hand, frictions, gripper, arm_with_gripper(load_arm(), gripper), GraspParams())


def _angle(a: NDArray, b: NDArray) -> NDArray:
    """Between unit vectors [rad]."""
    return np.arccos(np.clip(np.sum(a * b, axis=-1), -1, 1))
