"""The benchmark of one tick: rows made by hand."""

import numpy as np
import pytest

from experiments.benchmark.tick import rows_of


def test_rows_on_times_made_by_hand() -> None:
    found = {"tick": [0.5] * 98 + [1.0, 9.0], "image": [10.0, 20.0], "wait": [1.0, 3.0], "command": [12.0, 24.0]}
    rows = {name: row["value"] for name, row in rows_of({**found, "points": [100.0, 300.0], "refused": 0}).items()}
    assert rows["p50_ms"] == 0.5 and rows["worst_ms"] == 9.0 and rows["deadline_share"] == 0.01
    assert rows["p99_ms"] == pytest.approx(np.percentile(found["tick"], 99))
    assert rows["left_for_camera_ms"] == pytest.approx(45 - rows["command_p99_ms"])
    assert rows["points"] == 200 and rows["image_p50_ms"] == 15
