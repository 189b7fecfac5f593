"""Labelled points as a PLY file."""

from pathlib import Path

import numpy as np
from jaxtyping import Float, Int

from hrcjax.lab.atomic import write_bytes

ROW = np.dtype([(n, "<f4") for n in "xyz"] + [(n, "u1") for n in ("red", "green", "blue", "label")])


def write_ply(
    path: Path,
    points: Float[np.ndarray, "point 3"],
    label: Int[np.ndarray, "point"],
    colours: Int[np.ndarray, "label 3"],
) -> None:
    """Writes points [m] with their labels and the labels' colours (0 to 255), binary.

    Raises:
        StorageError: it could not be written.
    """
    rows = np.zeros(len(points), ROW)
    for a, name in enumerate("xyz"):
        rows[name] = points[:, a]
    for a, name in enumerate(("red", "green", "blue")):
        rows[name] = colours[label, a]
    rows["label"] = label
    kinds = {"f": "float", "u": "uchar"}
    properties = "".join(f"property {kinds[ROW[name].kind]} {name}\n" for name in ROW.names or ())
    header = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(rows)}\n{properties}end_header\n"
    write_bytes(path, header.encode() + rows.tobytes())
