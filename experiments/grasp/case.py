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
from hrcjax.grasp.motion_policy import MotionPolicyParams
from hrcjax.grasp.params import GraspParams
from hrcjax.grasp.reach import arm_with_gripper
from hrcjax.grasp.seen_points import SeenPoints
from hrcjax.robot import Arm, load_arm

from .hand_looks import look_reached
from .lift import Lifted, lift
from .look import TARGET_HEIGHT, exact_surface, hand_cameras, hand_eyes, look, stacked, stationary_cameras, unseen
from .move import move, summary
from .objects import NAMES, shape_named
from .perceive import perceive
from .pipeline import Planned, object_field, plan, reached
from .pull import pull
from .scene import WORK, draw_poses, make_scene, scene_xml
from .touch import least_distances, link_distances

TRIED = 16
"""Grasps, best first, of which the first that the arm reaches is taken."""
KEPT = 2000
"""Points of the exact surface that are stored."""
NOTHING = Lifted(False, 0.0, False, 0.0, 0.0, 0.0)
EACH = 5
"""Control periods between two checks for touching."""
FIXED = ("ok", "error", "free", "taken", "true_angles", "true_angle", "lifted")
"""What is stored of the ways by the stationary cameras alone."""


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
        key = jax.random.fold_in(jax.random.key(seed), 1000 * index + number)
        fixed = [look(scene, camera) for camera in stationary_cameras()]
        seen = perceive(*stacked(fixed, key), self.frames)
        at = seen_place(seen)
        looks = [look(scene, camera) for camera in hand_cameras(at)]
        truth = _Truth(*exact_surface(fixed + looks))
        found: dict[str, Any] = {"place": pose[0], "yaw": pose[1], "rest": pose[2], "centre": scene.centre(), "aim": at}
        if self.hand:
            aim = jnp.asarray([*at, TARGET_HEIGHT], jnp.float32)
            reach = [bool(look_reached(self.arm, jnp.asarray(eye, jnp.float32), aim)) for eye in hand_eyes(np.asarray(aim, float))]  # fmt: skip
            found["looks_reached"] = np.array(reach)
            taken = [one if can else unseen(one) for one, can in zip(looks, reach, strict=True)]
            few, seen = seen, perceive(*stacked(fixed + taken, key), self.frames)
            for way, planned in plan(few, self.gripper, self.params).items():
                own = self._way(planned, truth, shape, pose, self.frictions[:1], pulled=False)
                found |= {f"{way}_fixed_{part}": own[part] for part in FIXED}
        few = np.random.default_rng(0).permutation(len(truth.points))[:KEPT]
        found |= {
            "points": seen.cloud.points, "mask": seen.cloud.mask, "more": seen.more,
            "surface": truth.points[few].astype(np.float32), "surface_normal": truth.normals[few].astype(np.float32),
        }  # fmt: skip
        for way, planned in plan(seen, self.gripper, self.params).items():
            own = self._way(planned, truth, shape, pose, self.frictions)
            found |= {f"{way}_{key}": value for key, value in own.items()}
            if way == "hessian" and own["taken"] >= 0:
                found |= self._moved(seen, planned.grasps, own, shape, pose)
        return found

    def _way(self, planned: Planned, truth: "_Truth", shape: Any, pose: Any, frictions: tuple[float, ...], pulled: bool = True) -> dict[str, Any]:  # fmt: skip
        """Errors of the normals, the grasps, and what became of the first that is reached."""
        contacts, grasps = jax.tree.map(np.asarray, planned)
        exact = truth.normals_at(contacts.points)
        first = jax.tree.map(lambda leaf: jnp.asarray(leaf[:TRIED]), grasps)
        solved = reached(self.arm, first, self.params.approach)
        can = np.asarray(solved.ok) & grasps.mask[:TRIED]
        taken = int(np.argmax(can)) if can.any() else -1
        lifts, borne = [NOTHING] * len(frictions), 0.0
        if taken >= 0:
            R, p = grasps.R[taken].astype(float), grasps.p[taken].astype(float)
            for k, mu in enumerate(frictions):
                scene = make_scene(shape, pose, self.gripper, mu)
                lifts[k] = lift(scene, R, p, float(grasps.opening[taken]), float(jnp.asarray(self.params.approach)))
                if pulled and k == 0 and lifts[0].lifted:
                    borne = pull(scene)
        angles = true_angles(exact[grasps.contact], grasps.R[:, :, 1])
        return {
            "normals": contacts.normals, "planarity": contacts.planarity, "ok": contacts.mask,
            "error": _angle(contacts.normals, exact), "R": grasps.R, "p": grasps.p, "width": grasps.width,
            "opening": grasps.opening, "score": grasps.score, "contact": grasps.contact, "free": grasps.mask, "reached": can,
            "taken": taken, "true_angles": angles, "true_angle": angles[taken] if taken >= 0 else np.nan, "pull": borne,
            "q_before": np.asarray(solved.q_before[max(taken, 0)]),
            **{key: np.array([asdict(one)[key] for one in lifts]) for key in asdict(NOTHING)},
        }  # fmt: skip

    def _moved(self, seen: SeenPoints, grasps: Any, own: Mapping[str, Any], shape: Any, pose: Any) -> dict[str, Any]:
        """The arm goes to the chosen grasp by its policies, and what becomes of the lift from where it arrives."""
        k = own["taken"]
        opening = float(own["opening"][k])
        chosen = jax.tree.map(lambda leaf: leaf[k], grasps)
        field, back = object_field(seen, self.params), jnp.asarray(self.params.approach, grasps.p.dtype)
        moved = summary(move(self.arm, self.gripper, MotionPolicyParams(), field, chosen, back, jnp.asarray(own["q_before"])))  # fmt: skip
        scene = make_scene(shape, pose, self.gripper)
        some = slice(None, None, EACH)
        free = least_distances(scene, moved["R"][some].astype(float), moved["p"][some].astype(float), opening)
        links = link_distances(scene, scene_xml(shape, pose, self.gripper), self.arm, moved["q"][some])
        begin = int(np.argmax(moved["way"] > 0))
        came = moved["R"][begin:].astype(float), moved["p"][begin:].astype(float)
        lifted = lift(scene, came[0][-1], came[1][-1], opening, came=came) if moved["way"][-1] > 0 else NOTHING
        whole = {"free": free.min(), "links": links.min(), "lifted": lifted.lifted, "pushed": lifted.pushed}
        kept = {key: value for key, value in moved.items() if key not in ("R", "way")}
        kept |= {key: kept[key][some] for key in ("q", "p")}
        return {f"moved_{key}": np.asarray(value) for key, value in (kept | whole).items()}


class _Truth:
    """The exact surface as far as any camera sees it: for judging alone."""

    def __init__(self, points: NDArray, normals: NDArray) -> None:
        self.points, self.normals, self.tree = points, normals, KDTree(points)

    def normals_at(self, points: NDArray) -> NDArray:
        """Those of the nearest places."""
        return self.normals[self.tree.query(points)[1]]


def seen_place(seen: SeenPoints) -> NDArray:
    """Where on the table the points are, the middle of their box; without points the middle of all places (2) [m]."""
    points = np.asarray(seen.cloud.points, float)[np.asarray(seen.cloud.mask), :2]
    return np.array(WORK) if len(points) == 0 else (points.min(axis=0) + points.max(axis=0)) / 2


def true_angles(normals: NDArray, axes: NDArray) -> NDArray:
    """Greater angle between the closing axis and the exact normals of both contacts [rad].

    Args:
        normals: out of the object, at the first and the second contact (grasp, 2, 3).
        axes: from the first contact to the second (grasp, 3).
    """
    first, second = -np.sum(normals[:, 0] * axes, axis=1), np.sum(normals[:, 1] * axes, axis=1)
    return np.arccos(np.clip(np.minimum(first, second), -1, 1))


def make_bench(frames: int, hand: bool, frictions: tuple[float, ...]) -> Bench:
    """A UR5 with the default gripper."""
    gripper = Gripper()
    return Bench(frames, hand, frictions, gripper, arm_with_gripper(load_arm(), gripper), GraspParams())


def _angle(a: NDArray, b: NDArray) -> NDArray:
    """Between unit vectors [rad]."""
    return np.arccos(np.clip(np.sum(a * b, axis=-1), -1, 1))
