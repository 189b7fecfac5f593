"""Scenes as TOML files: named shapes in metres, and the task among them."""

import json
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import jax.numpy as jnp
import numpy as np

from hrcjax.lab.atomic import write_bytes
from hrcjax.lab.errors import UsageError, one_line
from hrcjax.world import CAPACITY, Scene, robotica
from hrcjax.world.scene import BOX, COLUMN, SPHERE
from hrcjax.world.scenes import Obstacle, make_scene

SHAPES = {"sphere": SPHERE, "column": COLUMN, "box": BOX}
SIZES = {"sphere": ("radius",), "column": ("radius", "height"), "box": ("half_extents",)}
TASK = ("start", "goal", "lower", "upper")
BOUNDS = ("table_lower", "table_upper")


def is_scene_file(name: str) -> bool:
    """Whether a value of `--scene` is a file."""
    return name.lower().endswith(".toml")


def write_scene(path: Path, scene: Scene, names: Sequence[str], note: str = "") -> None:
    """Writes the obstacles of a scene that exist, with their names, and its task.

    Args:
        note: lines of a comment at the top.

    Raises:
        StorageError: it could not be written.
    """
    lines = [f"# {line}" for line in note.splitlines()] + ["# Lengths in metres, angles in radians."]
    lines += [f"{name} = {_numbers(getattr(scene, name))}" for name in (*TASK, *BOUNDS)]
    kinds = {kind: name for name, kind in SHAPES.items()}
    for k, name in zip(np.flatnonzero(np.asarray(scene.mask)), names, strict=True):
        shape, size = kinds[int(scene.kind[k])], np.asarray(scene.size[k], float)
        lines += ["", "[[obstacles]]", f"name = {json.dumps(name)}", f'shape = "{shape}"', f"center = {_numbers(scene.center[k])}"]  # fmt: skip
        if shape == "box":
            lines += [f"half_extents = {_numbers(size)}", f"yaw = {_number(scene.yaw[k])}"]
        else:
            lines.append(f"radius = {_number(size[0])}")
        if shape == "column":
            lines.append(f"height = {_number(2 * size[2])}")
    write_bytes(path, ("\n".join(lines) + "\n").encode())


def read_scene(path: Path, dtype: Any = jnp.float32) -> tuple[Scene, list[str]]:
    """The scene of a file, and the names of its obstacles. What it does not say of task and table is the Robotica paper's.

    Raises:
        UsageError: no such file, invalid TOML, an unknown key or shape, a number that is none, a size that is not positive.
    """
    try:
        entries = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise UsageError(f"scene {path}: {one_line(error)}") from error
    for key in entries:
        if key not in (*TASK, *BOUNDS, "obstacles"):
            raise UsageError(f"scene {path}: unknown key {key!r}; accepted: {', '.join((*TASK, *BOUNDS))}, [[obstacles]]")  # fmt: skip
    like = robotica(dtype=dtype)
    task = [_vector(path, entries.get(name, np.asarray(getattr(like, name), float).tolist()), 3, name) for name in TASK]
    tables = entries.get("obstacles", [])
    if not isinstance(tables, list) or not all(isinstance(one, dict) for one in tables):
        raise UsageError(f"scene {path}: obstacles are tables, [[obstacles]]")
    found = [_obstacle(path, k + 1, one) for k, one in enumerate(tables)]
    names = [str(one.get("name", f"obstacle {k + 1}")) for k, one in enumerate(tables)]
    scene = make_scene(found, *task, dtype=dtype, capacity=max(CAPACITY, len(found)))
    bounds = {name: jnp.asarray(_vector(path, entries[name], 2, name), dtype) for name in BOUNDS if name in entries}
    return Scene(**{**vars(scene), **bounds}), names


def _number(value: Any) -> str:
    return repr(round(float(value), 6))


def _numbers(values: Any) -> str:
    return f"[{', '.join(_number(v) for v in np.asarray(values, float))}]"


def _vector(path: Path, value: Any, size: int, what: str) -> list[float]:
    good = isinstance(value, list) and len(value) == size and all(isinstance(v, int | float) and not isinstance(v, bool) and np.isfinite(v) for v in value)  # fmt: skip
    if not good:
        raise UsageError(f"scene {path}: {what} is {value!r}; accepted are {size} numbers")
    return [float(v) for v in value]


def _obstacle(path: Path, number: int, entry: dict[str, Any]) -> Obstacle:
    where, shape = f"obstacle {number}", entry.get("shape")
    if shape not in SHAPES:
        raise UsageError(f"scene {path}: {where} has the shape {shape!r}; accepted: {', '.join(SHAPES)}")
    known = {"name", "shape", "center", *SIZES[shape], *(("yaw",) if shape == "box" else ())}
    missing, foreign = sorted({"center", *SIZES[shape]} - set(entry)), sorted(set(entry) - known)
    if missing or foreign:
        raise UsageError(f"scene {path}: {where}, a {shape}, " + (f"lacks {missing[0]}" if missing else f"has no {foreign[0]}"))  # fmt: skip

    def length(name: str) -> float:
        return _vector(path, [entry[name]], 1, f"{name} of {where}")[0]

    center = _vector(path, entry["center"], 3, f"center of {where}")
    yaw = _vector(path, [entry.get("yaw", 0.0)], 1, f"yaw of {where}")[0]
    if shape == "box":
        size = _vector(path, entry["half_extents"], 3, f"half_extents of {where}")
    else:
        size = [length("radius")] * 3
    if shape == "column":
        size[2] = length("height") / 2
    if min(size) <= 0:
        raise UsageError(f"scene {path}: {where} has a size of {min(size):g} m; accepted are sizes above 0")
    radius = (size[0] + size[1]) / 2
    return Obstacle(SHAPES[shape], (center[0], center[1], center[2]), (size[0], size[1], size[2]), yaw, radius)
