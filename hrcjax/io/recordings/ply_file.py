"""PLY files, ASCII and binary, read by the library trimesh."""

from pathlib import Path

import numpy as np

from hrcjax.lab.errors import UsageError

ACCEPTED = "a whole PLY file, ASCII or binary, whose vertices have x, y, z in metres"
LONGEST_HEADER = 1000  # lines


WHOLE = ("char", "uchar", "short", "ushort", "int", "uint", "int8", "uint8", "int16", "uint16", "int32", "uint32")
"""Integer types."""


def read_ply(path: Path, per_metre: float | None = None) -> tuple[np.ndarray, np.ndarray | None]:
    """Vertices, float64 (point, 3) [m], in the file's axes; the sensor's position, float64 (3,) [m], or None.

    The position is that of an element `camera` with view_px, view_py, view_pz, as the Point Cloud Library writes it.
    Faces, normals and colours are ignored.

    Args:
        per_metre: the file's units per metre; if None 1.

    Raises:
        UsageError: a missing or truncated file, another format, vertices without x, y, z, or integers without a unit.
    """
    from trimesh.exchange.ply import load_ply  # takes long to import and is needed for these files alone

    properties = _vertex_properties(path)
    whole = [name for name in "xyz" if properties.get(name) in WHOLE]
    if whole and per_metre is None:
        raise UsageError(
            f"PLY file {path}: {', '.join(whole)} are integers ({properties[whole[0]]}), which are not metres: accepted is "
            "the number of units per metre by --per-metre (1000: millimetres)"
        )
    missing = [name for name in "xyz" if name not in properties]
    if missing:
        raise UsageError(f"PLY file {path}: its vertices have no {', '.join(missing)}; accepted is {ACCEPTED}")
    try:
        with path.open("rb") as stream:
            elements = load_ply(stream, fix_texture=False, skip_materials=True)["metadata"]["_ply_raw"]
        vertex = elements["vertex"]
        if vertex["length"] == 0:
            return np.empty((0, 3)), None
        points = np.column_stack([np.ravel(vertex["data"][name]) for name in "xyz"]).astype(np.float64)
        camera = elements.get("camera", {}).get("data")
        names = ("view_px", "view_py", "view_pz")
        known = () if camera is None else camera.dtype.names if isinstance(camera, np.ndarray) else camera.keys()
        position = None
        if camera is not None and set(names) <= set(known or ()):
            position = np.array([np.ravel(camera[name])[0] for name in names], np.float64)
    except Exception as error:  # the library raises errors of many types on broken files
        raise _broken(path, " ".join(str(error).split()) or type(error).__name__) from error
    if len(points) != vertex["length"]:
        raise _broken(path, f"{vertex['length']} vertices are declared, but there are {len(points)}")
    if position is not None and not np.isfinite(position).all():
        raise _broken(path, "the position of its camera is not finite")
    scale = per_metre or 1.0
    return points / scale, None if position is None else position / scale


def _broken(path: Path, what: str) -> UsageError:
    return UsageError(f"broken PLY file {path}: {what}; accepted is {ACCEPTED}")


def _vertex_properties(path: Path) -> dict[str, str]:
    """Names and types of the vertex properties in the header."""
    found: dict[str, str] = {}
    element = ""
    try:
        with path.open("rb") as stream:
            if stream.readline(80).strip() != b"ply":
                raise _broken(path, "it does not begin with ply")
            for _ in range(LONGEST_HEADER):
                words = stream.readline(10_000).decode("utf-8").split()
                if words[:1] == ["end_header"]:
                    return found
                if words[:1] == ["element"]:
                    element = words[1] if len(words) > 1 else ""
                elif words[:1] == ["property"] and element == "vertex":
                    found[words[-1]] = words[1] if len(words) > 2 else ""
    except FileNotFoundError:
        raise UsageError(f"no PLY file at {path}: accepted is {ACCEPTED}") from None
    except (OSError, UnicodeDecodeError) as error:
        raise UsageError(f"PLY file {path} cannot be read ({type(error).__name__}): accepted is {ACCEPTED}") from None
    raise _broken(path, "its header does not end with end_header")
