"""A detector as an ONNX file: the arrays it gives, and a whole tiny network, written here byte by byte."""

import struct
from pathlib import Path

import numpy as np
import pytest

from hrcjax.io.onnx_segmenter import detections, open_segmenter, read_names
from hrcjax.lab.errors import UsageError

BOXES = np.array([[1, 2, 5, 6], [0, 0, 3, 3]], np.float32)
LABELS, SCORES = np.array([1, 7], np.int64), np.array([0.9, 0.2], np.float32)


def test_detections_by_the_shapes_of_arrays() -> None:
    mask = np.zeros((2, 1, 8, 10), np.float32)
    mask[0, 0, 2:6, 1:5] = 0.8
    found = detections([mask, SCORES, LABELS, BOXES], (8, 10), ["background", "cup"])
    assert [(one.name, one.box) for one in found] == [("cup", (1.0, 2.0, 5.0, 6.0))]
    assert found[0].mask is not None and found[0].mask.sum() == 16
    assert detections([BOXES, LABELS, SCORES], (8, 10), [])[0].name == "1"
    with pytest.raises(UsageError, match="accepted are boxes"):
        detections([BOXES, LABELS], (8, 10), [])
    with pytest.raises(UsageError, match="masks of"):
        detections([BOXES, LABELS, SCORES, mask], (80, 100), [])


def test_names_are_lines(tmp_path: Path) -> None:
    (tmp_path / "n.txt").write_text("background\n cup\n\n")
    assert read_names(tmp_path / "n.txt") == ["background", "cup"]
    with pytest.raises(UsageError, match="--names"):
        read_names(tmp_path / "none.txt")


def varint(value: int) -> bytes:
    out = b""
    while value > 127:
        out, value = out + bytes([value & 127 | 128]), value >> 7
    return out + bytes([value])


def number(field: int, value: int) -> bytes:
    return varint(field << 3) + varint(value)


def block(field: int, data: bytes | str) -> bytes:
    data = data.encode() if isinstance(data, str) else data
    return varint(field << 3 | 2) + varint(len(data)) + data


def value_info(field: int, name: str, kind: int, shape: tuple) -> bytes:
    """A ValueInfoProto: name, and a tensor type with sizes or names of axes."""
    axes = b"".join(block(1, number(1, n) if isinstance(n, int) else block(2, n)) for n in shape)
    return block(field, block(1, name) + block(2, block(1, number(1, kind) + block(2, axes))))


def constant(name: str, array: np.ndarray) -> bytes:
    """A TensorProto among the graph's initializers: float 1, int64 7."""
    kind = 1 if array.dtype == np.float32 else 7
    return block(5, b"".join(number(1, n) for n in array.shape) + number(2, kind) + block(8, name) + block(9, array.tobytes()))  # fmt: skip


def network() -> bytes:
    """scores = SCORES + 0 x the image's first pixel ...: boxes and labels pass through Identity, masks are image[0:1] > 0.5."""
    nodes = b""
    for entry, out in (("boxes0", "boxes"), ("labels0", "labels"), ("scores0", "scores")):
        nodes += block(1, block(1, entry) + block(2, out) + block(4, "Identity"))
    nodes += block(1, block(1, "image") + block(1, "axes") + block(2, "lifted") + block(4, "Unsqueeze"))
    tensors = constant("boxes0", BOXES[:1]) + constant("labels0", LABELS[:1]) + constant("scores0", SCORES[:1])
    tensors += constant("axes", np.array([0], np.int64)) + constant("red", np.array([0], np.int64))
    nodes += block(1, block(1, "lifted") + block(1, "red") + block(2, "masks") + block(4, "Gather") + block(5, block(1, "axis") + number(3, 1) + number(20, 2)))  # fmt: skip
    graph = nodes + block(2, "tiny") + tensors
    graph += value_info(11, "image", 1, (3, "height", "width"))
    graph += value_info(12, "boxes", 1, (1, 4)) + value_info(12, "labels", 7, (1,)) + value_info(12, "scores", 1, (1,))
    graph += value_info(12, "masks", 1, (1, 1, "height", "width"))
    return number(1, 8) + block(7, graph) + block(8, block(1, "") + number(2, 13))


def test_the_bytes_are_those_of_protobuf() -> None:
    assert varint(300) == b"\xac\x02" and block(2, "ab") == b"\x12\x02ab" and number(1, 8) == b"\x08\x08"
    assert struct.pack("<f", 1.0) in constant("x", np.ones(1, np.float32))


def test_a_tiny_network_finds_what_it_says(tmp_path: Path) -> None:
    pytest.importorskip("onnxruntime", reason="onnxruntime is not installed: pip install -e '.[perception]'")
    (tmp_path / "tiny.onnx").write_bytes(network())
    (tmp_path / "n.txt").write_text("background\ncup\n")
    colour = np.zeros((8, 10, 3), np.uint8)
    colour[2:6, 1:5, 0] = 255
    found = open_segmenter(tmp_path / "tiny.onnx", tmp_path / "n.txt")(colour)
    assert [one.name for one in found] == ["cup"] and found[0].score == pytest.approx(0.9)
    assert found[0].mask is not None
    np.testing.assert_array_equal(found[0].mask, colour[..., 0] > 0)
    (tmp_path / "no.onnx").write_bytes(b"nothing")
    with pytest.raises(UsageError, match=r"--segmenter .*no\.onnx"):
        open_segmenter(tmp_path / "no.onnx")


def test_without_the_extra_one_line_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import importlib

    real = importlib.import_module

    def absent(name: str, *rest: str) -> object:
        if name == "onnxruntime":
            raise ImportError
        return real(name, *rest)

    monkeypatch.setattr(importlib, "import_module", absent)
    with pytest.raises(UsageError, match=r"pip install 'hrcjax\[perception\]'"):
        open_segmenter(tmp_path / "any.onnx")
