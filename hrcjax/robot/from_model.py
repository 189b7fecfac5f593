"""An arm from any MuJoCo model of one serial chain of hinges: its limits, capsules and tool as the model states them."""

# pyright: reportAttributeAccessIssue=false
# mujoco's types are compiled and have no stubs

from collections.abc import Sequence

import mujoco
import numpy as np

from hrcjax.robot.body import Arm, covering_spheres
from hrcjax.robot.chain import chain_from_mujoco

SHAPES = ("sphere", "capsule", "cylinder")
"""Geoms that become capsules; a cylinder gets round ends, which stand out by its radius."""


def arm_from_model(
    model: mujoco.MjModel,
    name: str,
    *,
    tool: str = "tool",
    home: str | Sequence[float] = "home",
    speed: float | Sequence[float] = np.pi,
    acceleration: float | Sequence[float] = 15.0,
    torque: float | Sequence[float] | None = None,
    geom_group: int | None = None,
) -> Arm:
    """The arm that a compiled model describes. `hrcjax.io.arms` reads the model from an MJCF file.

    From the model: masses and inertias, ranges of the joints (2 pi either way where a joint has none), spheres, capsules and
    cylinders as its shape, a site as its tool, a keyframe as its home posture, the force ranges of its motors. MJCF does not
    state speeds and accelerations of joints: they are given here. Control spheres cover every moving capsule to within
    `COVER_MARGIN`.

    Args:
        model: one serial chain of hinges whose base stands at the world's origin, z up.
        name: of the arm, for messages.
        tool: site on the last link: the tool point, its z axis pointing out of the flange.
        home: keyframe, or joint positions: the tool points down, the elbow is up [rad].
        speed: largest speed, of all joints or of each [rad/s].
        acceleration: largest acceleration, of all joints or of each [rad/s^2].
        torque: largest torque, of all joints or of each; None: the force range of the joint's motor [N m].
        geom_group: take the geoms of this group alone; None: all.

    Raises:
        ValueError: not one chain of hinges; no such site or keyframe; no shape that rides on a moving link; a joint without
            a known torque.
    """
    chain = chain_from_mujoco(model)
    n = chain.size
    limited = np.asarray(model.jnt_limited, bool)
    low, high = (np.where(limited, model.jnt_range[:, k], s * 2 * np.pi) for k, s in ((0, -1.0), (1, 1.0)))
    site = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SITE, tool)
    if site < 0:
        known = [model.site(i).name for i in range(model.nsite)]
        raise ValueError(
            f"arm {name}: no site {tool!r} for the tool; accepted: {', '.join(known) or 'a model with a site'}"
        )
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)  # at the reference posture, where joint frames and bodies are compared
    link, axes, tool_offset = _on_link(
        model, data, int(model.site_bodyid[site]), data.site_xmat[site], data.site_xpos[site]
    )
    if link != n - 1:
        raise ValueError(
            f"arm {name}: site {tool!r} does not ride on the last link; accepted: a site behind the last joint"
        )
    shapes = _capsules(model, data, geom_group)
    if not any(link >= 0 for _, link, *_ in shapes):
        raise ValueError(f"arm {name}: no geom rides on a moving link; accepted: {', '.join(SHAPES)}")
    shapes.sort(key=lambda shape: shape[1])
    if shapes[0][1] >= 0:  # the base comes first, and this arm has no shape for it
        shapes.insert(0, ("base", -1, np.zeros(3), np.zeros(3), 1e-3))
    bare = [i for i in range(n) if chain.mass[i] > 0 and not any(link == i for _, link, *_ in shapes)]
    if bare:
        joint = model.joint(bare[0]).name or bare[0]
        raise ValueError(
            f"arm {name}: no geom rides on the link of joint {joint!r}; accepted: {', '.join(SHAPES)} on each link"
        )
    covered = [(link, *covering_spheres(a, b, radius)) for _, link, a, b, radius in shapes if link >= 0]
    return Arm(
        variant=name,
        model=model,
        chain=chain,
        q_min=low,
        q_max=high,
        qd_max=_positive(name, "speed", speed, n),
        qdd_max=_positive(name, "acceleration", acceleration, n),
        tau_max=_torques(model, name, torque),
        home=_home(model, name, home, low, high),
        capsule_names=tuple(shape[0] for shape in shapes),
        capsule_links=tuple(shape[1] for shape in shapes),
        capsule_a=np.stack([shape[2] for shape in shapes]),
        capsule_b=np.stack([shape[3] for shape in shapes]),
        capsule_radii=np.array([shape[4] for shape in shapes]),
        control_links=tuple(link for link, centres, _ in covered for _ in centres),
        control_offsets=np.concatenate([centres for _, centres, _ in covered]),
        control_radii=np.array([radius for _, centres, radius in covered for _ in centres]),
        tool_link=link,
        tool_offset=tool_offset,
        tool_axes=axes,
    )


def _on_link(
    model: mujoco.MjModel, data: mujoco.MjData, body: int, matrix: np.ndarray, position: np.ndarray
) -> tuple[int, np.ndarray, np.ndarray]:
    """The link a body belongs to (-1: it does not move), and a frame of the world in the link's own axes and origin."""
    weld = int(model.body_weldid[body])
    R, p = (np.eye(3), np.zeros(3)) if weld == 0 else (data.xmat[weld].reshape(3, 3), data.xpos[weld])
    link = -1 if weld == 0 else int(model.body_jntadr[weld] + model.body_jntnum[weld] - 1)
    axes, place = R.T @ np.reshape(matrix, (3, 3)), R.T @ (position - p)
    return link, np.where(np.abs(axes) < 1e-12, 0.0, axes), place


def _capsules(
    model: mujoco.MjModel, data: mujoco.MjData, group: int | None
) -> list[tuple[str, int, np.ndarray, np.ndarray, float]]:
    """Name, link, both ends in the link's frame [m] and radius [m] of every geom that is a capsule or nearly one."""
    found = []
    kinds = {int(getattr(mujoco.mjtGeom, f"mjGEOM_{shape.upper()}")): shape for shape in SHAPES}
    for g in range(model.ngeom):
        shape = kinds.get(int(model.geom_type[g]))
        if group is not None and model.geom_group[g] != group:
            continue
        if shape is None:
            collides = model.geom_contype[g] or model.geom_conaffinity[g]
            if collides and model.body_weldid[model.geom_bodyid[g]] != 0:
                raise ValueError(
                    f"geom {model.geom(g).name or g} collides and is no {' or '.join(SHAPES)}; accepted: these shapes, or "
                    "geom_group=... that leaves it out"
                )
            continue
        link, axes, centre = _on_link(model, data, int(model.geom_bodyid[g]), data.geom_xmat[g], data.geom_xpos[g])
        half = 0.0 if shape == "sphere" else float(model.geom_size[g, 1])
        reach = half * axes[:, 2]
        name = model.geom(g).name or f"{shape} {g}"
        found.append((name, link, centre - reach, centre + reach, float(model.geom_size[g, 0])))
    return found


def _torques(model: mujoco.MjModel, name: str, given: float | Sequence[float] | None) -> np.ndarray:
    n = model.njnt
    if given is not None:
        return _positive(name, "torque", given, n)
    motors = np.full(n, np.inf)
    for i in range(model.nu):
        if model.actuator_trntype[i] == mujoco.mjtTrn.mjTRN_JOINT and model.actuator_forcelimited[i]:
            joint = model.actuator_trnid[i, 0]
            motors[joint] = min(
                motors[joint], abs(model.actuator_gear[i, 0]) * np.abs(model.actuator_forcerange[i]).min()
            )
    joints = np.where(model.jnt_actfrclimited, np.abs(model.jnt_actfrcrange).min(axis=1), np.inf)
    top = np.minimum(motors, joints)
    if not (np.isfinite(top) & (top > 0)).all():
        joint = model.joint(int(np.argmax(~(np.isfinite(top) & (top > 0))))).name
        raise ValueError(
            f"arm {name}: the model states no torque of joint {joint!r}; accepted: torque=..., or a motor with forcerange"
        )
    return top


def _positive(name: str, what: str, given: float | Sequence[float], n: int) -> np.ndarray:
    try:
        values = np.broadcast_to(np.asarray(given, float), n).copy()
    except ValueError:
        raise ValueError(f"arm {name}: {what} of {np.size(given)} numbers; accepted: one, or {n}") from None
    if not (np.isfinite(values) & (values > 0)).all():
        raise ValueError(f"arm {name}: {what} {given}; accepted: finite numbers above 0")
    return values


def _home(
    model: mujoco.MjModel, name: str, home: str | Sequence[float], low: np.ndarray, high: np.ndarray
) -> np.ndarray:
    if not isinstance(home, str):
        q = np.asarray(home, float)
        if q.shape != (model.njnt,) or not ((q >= low) & (q <= high)).all():
            raise ValueError(f"arm {name}: home {home}; accepted: {model.njnt} joint positions within their ranges")
        return q
    key = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_KEY, home)
    if key < 0:
        known = [model.key(i).name for i in range(model.nkey)]
        raise ValueError(f"arm {name}: no keyframe {home!r}; accepted: {', '.join(known) or 'joint positions'}")
    return np.array(model.key_qpos[key])
