"""A detector that a user brings as an ONNX file, run by onnxruntime (extra `perception`)."""

import importlib
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import UInt

from hrcjax.lab.errors import UsageError, one_line
from hrcjax.task_space import Detection, Segmenter

EXTRA = "a detector needs the extra: pip install 'hrcjax[perception]' (onnxruntime is not installed)"
LEAST_SCORE = 0.5
"""Detections with a lower score are left out [1]."""
SOLID = 0.5
"""Least value of a mask's pixel that belongs to an object [1]."""


def read_names(path: Path) -> list[str]:
    """Names of classes, one on every line.

    Raises:
        UsageError: it cannot be read.
    """
    try:
        return [line.strip() for line in path.read_text(encoding="utf-8").splitlines() if line.strip()]
    except (OSError, ValueError) as error:
        raise UsageError(f"--names {path}: {one_line(error)}") from error


def open_segmenter(path: Path, names: Path | None = None) -> Segmenter:
    """A segmenter from a file in the form in which torchvision exports a Mask R-CNN.

    One input: red, green and blue in 0 to 1, (3, height, width) or with a leading axis of one image. Outputs, told apart by
    their shapes: boxes (n, 4) as left, upper, right and lower edge [px]; labels (n,), whole numbers; scores (n,); and masks
    (n, 1, height, width) or (n, height, width) in 0 to 1, if there are any.

    Args:
        names: of the classes by number.

    Raises:
        UsageError: onnxruntime is missing, the file cannot be read, or it has another form.
    """
    called = read_names(names) if names else []
    try:
        runtime = importlib.import_module("onnxruntime")
    except ImportError as error:
        raise UsageError(EXTRA) from error
    try:
        session = runtime.InferenceSession(str(path), providers=["CPUExecutionProvider"])
    except Exception as error:  # the library raises errors of its own types
        raise UsageError(f"--segmenter {path}: {one_line(error)}") from error
    inputs = session.get_inputs()
    if len(inputs) != 1 or len(inputs[0].shape) not in (3, 4):
        shapes = ", ".join(str(one.shape) for one in inputs)
        raise UsageError(f"--segmenter {path} takes {shapes}; accepted is one image, (3, height, width)")
    entry, batched = inputs[0].name, len(inputs[0].shape) == 4

    def segment(colour: UInt[np.ndarray, "height width 3"]) -> list[Detection]:
        image = np.ascontiguousarray(np.moveaxis(colour, -1, 0), np.float32) / 255
        outputs = session.run(None, {entry: image[None] if batched else image})
        return detections(outputs, colour.shape[:2], called, str(path))

    return segment


def detections(outputs: list[Any], shape: tuple[int, int], names: list[str], where: str = "") -> list[Detection]:
    """Detections from the arrays that a network gives.

    Args:
        shape: rows and columns of the image.
        names: of the classes by number; those beyond are called by it.

    Raises:
        UsageError: the arrays are not boxes, labels and scores of one length.
    """
    arrays = [np.asarray(output) for output in outputs]
    boxes = next((a for a in arrays if a.ndim == 2 and a.shape[1] == 4), None)
    labels = next((a for a in arrays if a.ndim == 1 and np.issubdtype(a.dtype, np.integer)), None)
    scores = next((a for a in arrays if a.ndim == 1 and np.issubdtype(a.dtype, np.floating)), None)
    masks = next((a for a in arrays if a.ndim in (3, 4)), None)
    if boxes is None or labels is None or scores is None or not len(boxes) == len(labels) == len(scores):
        raise UsageError(f"--segmenter {where} gives arrays of {[a.shape for a in arrays]}; accepted are boxes (n, 4), labels (n,), scores (n,), masks (n, 1, height, width)")  # fmt: skip
    found = []
    for k in np.flatnonzero(scores >= LEAST_SCORE):
        mask = None if masks is None else masks[k].reshape(masks.shape[-2:]) >= SOLID
        if mask is not None and mask.shape != shape:
            raise UsageError(f"--segmenter {where} gives masks of {mask.shape} for an image of {shape}")
        number = int(labels[k])
        name = names[number] if number < len(names) else str(number)
        left, upper, right, lower = (float(v) for v in boxes[k])
        found.append(Detection((left, upper, right, lower), float(scores[k]), name, mask))
    return found
