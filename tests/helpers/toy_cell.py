"""A small stand-in for the cell: a point that goes round one obstacle, with all the outputs of the real one."""

import os
import time

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from hrcjax.sweeps.sweepable import Metric, Sweepable, Trace


class Potential(eqx.Module):
    k_att: float = 0.03
    k_rep: float = 0.1
    zeta: float = 4.0


class Collision(eqx.Module):
    k_rep: float = 0.4
    length_scale: float = 0.1


class Field(eqx.Module):
    length_scale: float = 0.2
    speed: float = 0.5


class ToyParams(eqx.Module):
    potential: Potential = eqx.field(default_factory=Potential)
    collision: Collision = eqx.field(default_factory=Collision)
    field: Field = eqx.field(default_factory=Field)


class ToyWorld(eqx.Module):
    start: jax.Array
    goal: jax.Array
    obstacle: jax.Array
    noise: jax.Array


TRACES = []
"""One entry per trace of `evaluate`."""
BUILT = []
"""One entry per world built."""
TIMES = 60
DELAY = float(os.environ.get("TOY_DELAY", "0"))


def _sleep(x: np.ndarray) -> np.ndarray:
    time.sleep(DELAY)
    return x


def evaluate(params: ToyParams, world: ToyWorld) -> dict[str, jax.Array]:
    TRACES.append(1)

    def one(p: ToyParams) -> dict[str, jax.Array]:
        s = jnp.linspace(0, 1, TIMES, dtype=jnp.asarray(p.potential.k_att).dtype)
        line = world.start + s[:, None] * (world.goal - world.start)
        away = jnp.asarray([0.5, 0.8, 0.2], s.dtype)
        push = 0.2 * p.potential.k_rep**0.3 * jnp.clip(jnp.sin(jnp.pi * s), 1e-6) ** (p.potential.zeta / 2)
        tool = line + (push * (1 + world.noise))[:, None] * away
        step = jnp.diff(tool, axis=0)
        length = jnp.sum(jnp.linalg.norm(step, axis=1))
        bending = jnp.sum(jnp.linalg.norm(jnp.diff(step, axis=0), axis=1) ** 2) * 1e3 * (1 + p.potential.k_att)
        gap = jnp.linalg.norm(tool - world.obstacle, axis=1)
        separation = 1.2 - 0.95 * jnp.exp(-(((s - 0.5 - 0.1 * p.potential.zeta / 5) / 0.15) ** 2))
        zone = sum((separation < limit).astype(jnp.int8) for limit in (1.1, 0.6, 0.32))
        clearance = jnp.min(gap) - 0.05
        score = 1 / (1 + length) + clearance - 0.02 * bending - (jnp.log(p.potential.k_att) + 3.5) ** 2 * 0.02
        return {
            "score": score,
            "length": length,
            "bending_energy": bending,
            "clearance": clearance,
            "plan": tool[::4],
            "tool": tool,
            "zone": zone,
            "separation": separation,
            "speed": 0.4 * jnp.clip((separation - 0.3) / 0.8, 0, 1) + 0.0 * p.field.speed,
            "status": jnp.where(clearance < 0.02, 1, 0).astype(jnp.int32),
        }

    axes = jax.tree.map(lambda leaf: 0 if jnp.ndim(leaf) else None, params)
    out = jax.vmap(one, in_axes=(axes,))(params)
    if DELAY:
        score = out["score"]
        out["score"] = jax.pure_callback(_sleep, jax.ShapeDtypeStruct(score.shape, score.dtype), score)
    return out


def build_problem(scenes, people, seeds, backend=None, cell="ur5", motion=None, obstacles="known") -> Sweepable:
    for scene in scenes:
        if scene not in ("robotica", "hri"):
            raise ValueError(f"no scene {scene!r}; accepted: robotica, hri")
    for person in people:
        if person.endswith(".bvh") and not os.path.isfile(person):
            raise ValueError(f"{person}: no such BVH file")

    def world(scene, person, seed):
        def build() -> ToyWorld:
            BUILT.append((scene, person, seed))
            shift = 0.1 * (scene == "hri") + 0.05 * len(person)
            noise = np.float32(np.random.default_rng(seed).normal() * 0.05)
            return ToyWorld(
                jnp.asarray([0.1, 0.7, 0.15], jnp.float32),
                jnp.asarray([0.7, 0.3 + shift / 10, 0.05], jnp.float32),
                jnp.asarray([0.36, 0.44, 0.1], jnp.float32),
                jnp.asarray(noise),
            )

        return build

    def describe(w: ToyWorld) -> dict[str, np.ndarray]:
        time_ = np.linspace(0, 8, 9)
        reach = np.exp(-(((time_ - 4) / 1.5) ** 2))[:, None]
        shoulder = np.array([0.95, 0.95, 0.45]) + 0 * reach
        hand = np.array([0.8, 0.8, 0.2]) + reach * np.array([-0.35, -0.2, 0.0])
        hip = np.array([1.0, 1.0, 0.0]) + 0 * reach
        head = np.array([0.95, 0.95, 0.75]) + 0 * reach
        a = np.stack([hip, shoulder, head], axis=1)
        b = np.stack([shoulder, hand, head + np.array([0, 0, 0.1])], axis=1)
        return {
            "start": np.asarray(w.start),
            "goal": np.asarray(w.goal),
            "obstacle_kind": np.array([0, 1, 2, 0], np.int32),
            "obstacle_center": np.stack([w.obstacle, [0.25, 0.3, 0.1], [0.55, 0.65, 0.1], [9, 9, 9]]),
            "obstacle_size": np.array([[0.05, 0.05, 0.05], [0.03, 0.03, 0.1], [0.08, 0.04, 0.1], [1, 1, 1]]),
            "obstacle_yaw": np.array([0, 0, 0.4, 0.0]),
            "obstacle_mask": np.array([True, True, True, False]),
            "person_a": a,
            "person_b": b,
            "person_radius": np.array([0.2, 0.07, 0.14]),
        }

    return Sweepable(
        params=ToyParams(),
        evaluate=evaluate,
        worlds=[
            ({"scene": s, "person": os.path.basename(p), "seed": n}, world(s, p, n))
            for s in scenes
            for p in people
            for n in seeds
        ],
        metrics={
            "score": Metric("1", "high", "overall score"),
            "length": Metric("m", "low", "length of the path"),
            "bending_energy": Metric("1/m", "low", "bending energy of the path"),
            "clearance": Metric("m", "high", "smallest distance to obstacles"),
        },
        traces={
            "plan": Trace(("waypoint", "xyz"), "m", "planned path"),
            "tool": Trace(("time", "xyz"), "m", "path of the tool"),
            "zone": Trace(("time",), "1", "zone: 0 green, 1 yellow, 2 red, 3 stop"),
            "separation": Trace(("time",), "m", "distance to the person"),
            "speed": Trace(("time",), "m/s", "speed of the tool"),
        },
        bytes_per_setting=100_000,
        identity=os.environ.get("TOY_IDENTITY"),
        aliases={"k_att": "potential.k_att", "K_rep": "potential.k_rep", "zeta": "potential.zeta"},
        domains={"potential.zeta": (1.0, float("inf")), "field.length_scale": (1e-6, 10.0)},
        statuses={0: "ok", 1: "collision"},
        coords={
            "time": (np.linspace(0, 8, TIMES), "s", "time"),
            "frame": (np.linspace(0, 8, 9), "s", "time of a frame of the person"),
        },
        describe=describe,
        described={
            "start": Trace(("xyz",), "m", "start"),
            "goal": Trace(("xyz",), "m", "goal"),
            "obstacle_kind": Trace(("obstacle",), "1", "0 sphere, 1 column, 2 box"),
            "obstacle_center": Trace(("obstacle", "xyz"), "m", "centre"),
            "obstacle_size": Trace(("obstacle", "xyz"), "m", "half extents"),
            "obstacle_yaw": Trace(("obstacle",), "rad", "turn about the vertical"),
            "obstacle_mask": Trace(("obstacle",), "1", "obstacle exists"),
            "person_a": Trace(("frame", "capsule", "xyz"), "m", "one end"),
            "person_b": Trace(("frame", "capsule", "xyz"), "m", "other end"),
            "person_radius": Trace(("capsule",), "m", "radius"),
        },
    )
