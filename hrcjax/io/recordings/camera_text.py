"""Parser of camera files: names with values (text, JSON, YAML), a matrix, or a row of numbers."""

import json
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from hrcjax.io.recordings.lens import Lens, lens_of

NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
ALIASES = {
    "fx": ("fx_depth", "fx", "fl_x", "focal_x", "f", "focal_length"),
    "fy": ("fy_depth", "fy", "fl_y", "focal_y"),
    "cx": ("mx_depth", "cx", "ppx", "c_x"),
    "cy": ("my_depth", "cy", "ppy", "c_y"),
    "width": ("depthwidth", "width", "image_width", "w", "img_width"),
    "height": ("depthheight", "height", "image_height", "h", "img_height"),
    "matrix": ("intrinsic_matrix", "camera_matrix", "k", "cam_k", "intrinsics", "intrinsic", "camera_intrinsics"),
    "bend": ("distortion_coefficients", "coeffs", "dist_coeffs", "distortion", "d", "disto"),
    "scale": ("depthmapfactor", "png_depth_scale", "depth_scale", "depthshift", "depth_factor", "per_metre", "scale"),
    "model": ("distortion_model", "camera_model", "camera.type", "model", "type"),
}
SEVERAL = ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6")
COLMAP = {"SIMPLE_PINHOLE": "fcc", "PINHOLE": "ffcc", "OPENCV": "ffcc", "OPENCV_FISHEYE": "ffcc"}


@dataclass(frozen=True)
class CameraNumbers:
    """Camera parameters in a file."""

    fx: float
    fy: float
    cx: float
    cy: float
    size: tuple[int, int] | None = None
    """Width and height [px]; None: not in the file."""
    lens: Lens | None = None
    per_metre: float | None = None
    """Units of depth per metre; None: not in the file."""


def camera_of_text(text: str) -> CameraNumbers | None:
    """The camera parameters in a text; None: none found.

    Raises:
        UsageError: an unknown distortion model.
    """
    try:
        found = json.loads(text)
    except ValueError:
        found = None
    if isinstance(found, dict | list):
        return _of_names(dict(_leaves(found))) or _of_numbers(_numbers_of(found))
    lines = [line for line in text.splitlines() if line.strip() and not line.lstrip().startswith(("#", "%"))]
    if len(lines) > 1 and not re.search(r"\d", lines[0]) and not re.search(r"[A-Za-z]", " ".join(lines[1:])):
        lines = lines[1:]  # a header line above the numbers
    words = " ".join(lines).replace(",", " ").replace("[", " ").replace("]", " ").replace(";", " ").split()
    if words and all(re.fullmatch(NUMBER, word) for word in words):
        return _of_numbers([float(word) for word in words])
    if len(words) > 4 and words[1] in COLMAP:
        return _of_colmap(words)
    return _of_names(_names_of("\n".join(lines)))


def _leaves(found: Any, key: str = "") -> Iterator[tuple[str, Any]]:
    """Names, in lower case, and values of nested JSON; entries for depth take precedence, those for colour are ignored."""
    if isinstance(found, Mapping):
        inner = [(str(name).lower(), value) for name, value in found.items()]
        inner = [item for item in inner if not re.search(r"colou?r|rgb|infra", item[0])]
        for name, value in sorted(inner, key=lambda item: "depth" in item[0] and isinstance(item[1], Mapping)):
            yield from _leaves(value, name)  # of duplicate names the last one is used
    elif key:
        yield key, found


def _names_of(text: str) -> dict[str, Any]:
    """Names, in lower case, and values of lines `name: value`, also in YAML, and of lists over several lines."""
    named: dict[str, Any] = {}
    for name, values in re.findall(r"([A-Za-z_][\w.]*)\s*[:=]\s*\[((?:[^\[\]]|\[[^\[\]]*\])*)\]", text):
        named[_short(name)] = [float(v) for v in re.findall(NUMBER, values)]
    block = r"^[ \t]*([A-Za-z_][\w.]*)[ \t]*:[^\n\[]*\n(?:[ \t]+(?!data)[^\n\[]*\n)*[ \t]+data[ \t]*:\s*\[([^\]]*)\]"
    for name, values in re.findall(block, text, re.MULTILINE):
        named[_short(name)] = [float(v) for v in re.findall(NUMBER, values)]
    apart = re.sub(r",[ \t]*(?=[A-Za-z_])", "\n", text)
    for name, value in re.findall(r"^[ \t]*([A-Za-z_][\w.]*)[ \t]*[:= \t][ \t]*(\S.*?)[ \t]*$", apart, re.MULTILINE):
        found = re.fullmatch(rf"({NUMBER})\s*(?:#.*)?", value)
        named.setdefault(_short(name), float(found[1]) if found else value.strip("\"' "))
    return named


def _short(name: str) -> str:
    return re.sub(r"^(camera1?|cam|rgbd|depth)\.(?!type)", "", name.lower())


def _numbers_of(found: Any) -> list[float]:
    """All numbers of a nested list; empty if it contains anything else."""
    if isinstance(found, (bool, str | Mapping)) or found is None:
        return []
    if isinstance(found, int | float):
        return [float(found)]
    return [number for item in found for number in _numbers_of(item)]


def _of_names(named: Mapping[str, Any]) -> CameraNumbers | None:
    def first(what: str) -> Any:
        return next((named[name] for name in ALIASES[what] if name in named), None)

    def number(what: str) -> float | None:
        value = first(what)
        return float(value) if isinstance(value, int | float) and not isinstance(value, bool) else None

    matrix = _of_numbers(_numbers_of(first("matrix")))
    values = [number(name) for name in ("fx", "fy", "cx", "cy")]
    if values[1] is None:
        values[1] = values[0]
    if matrix is None and None in values:
        return None
    fx, fy, cx, cy = (v for v in values if v is not None) if None not in values else _pinhole(matrix)
    width, height = number("width"), number("height")
    bend = _numbers_of(first("bend"))
    if not bend and "k1" in named:
        order = ("k1", "k2", "k3", "k4") if "p1" not in named else SEVERAL
        bend = [float(named.get(name, 0.0)) for name in order]
    model = first("model")
    fisheye = "fisheye" in str(model).lower() or "kannala" in str(model).lower()
    name = str(model) if isinstance(model, str) and (bend or fisheye) else ""
    scale = number("scale")
    return CameraNumbers(
        fx,
        fy,
        cx,
        cy,
        (int(width), int(height)) if width and height else None,
        lens_of(name, bend) if bend or fisheye else None,
        None if not scale or scale <= 0 else _per_metre(scale),
    )


def _pinhole(camera: CameraNumbers | None) -> tuple[float, float, float, float]:
    assert camera is not None
    return camera.fx, camera.fy, camera.cx, camera.cy


def _per_metre(scale: float) -> float:
    """A file's depth scale as units per metre: 1000 or 5000 are that; 0.001 is metres per unit; 0.1 or 1 (BOP) is
    millimetres per unit."""
    return scale if scale >= 100 else round(1 / scale, 3) if scale <= 0.01 else round(1000 / scale, 3)


def _of_numbers(numbers: Sequence[float]) -> CameraNumbers | None:
    """A matrix 3 x 3 (by rows or by columns), 3 x 4 or 4 x 4; or fx fy cx cy, with the size after or before it, or with
    k1 k2 p1 p2 (k3) after it."""
    n = list(numbers)
    if len(n) == 9 and n[6] == n[7] == 0 and n[8] == 1:
        return CameraNumbers(n[0], n[4], n[2], n[5])
    if len(n) == 9 and n[2] == n[5] == 0 and n[8] == 1:
        return CameraNumbers(n[0], n[4], n[6], n[7])
    if len(n) in (12, 16) and n[8] == n[9] == 0 and n[10] == 1:
        return CameraNumbers(n[0], n[5], n[2], n[6])
    if len(n) == 4:
        return CameraNumbers(n[0], n[1], n[2], n[3])
    if len(n) == 6 and 0 < n[2] < n[4] and 0 < n[3] < n[5]:
        return CameraNumbers(n[0], n[1], n[2], n[3], (int(n[4]), int(n[5])))
    if len(n) == 6 and 0 < n[4] < n[0] and 0 < n[5] < n[1]:
        return CameraNumbers(n[2], n[3], n[4], n[5], (int(n[0]), int(n[1])))
    if len(n) in (8, 9):
        return CameraNumbers(n[0], n[1], n[2], n[3], None, lens_of("", n[4:]))
    return None


def _of_colmap(words: Sequence[str]) -> CameraNumbers | None:
    """COLMAP's cameras.txt: id, model, width, height, numbers."""
    kind, size, numbers = words[1], (int(words[2]), int(words[3])), [float(v) for v in words[4:]]
    if kind == "SIMPLE_PINHOLE":
        numbers = [numbers[0], *numbers]
    lens = lens_of(kind.lower(), numbers[4:8]) if kind.startswith("OPENCV") else None
    return CameraNumbers(numbers[0], numbers[1], numbers[2], numbers[3], size, lens)
