"""Scenes as TOML files: what is written is read, and each error is one line."""

from pathlib import Path

import numpy as np
import pytest

from hrcjax.cells.scenes import scene_of
from hrcjax.io.scene_file import read_scene, write_scene
from hrcjax.lab.errors import UsageError
from hrcjax.world import clutter, robotica, scene_named


def test_a_scene_comes_back(tmp_path: Path) -> None:
    for scene in (clutter(3), robotica("spheres")):
        count = int(scene.mask.sum())
        write_scene(tmp_path / "s.toml", scene, [f'thing "{k}"' for k in range(count)], "two\nlines")
        back, names = read_scene(tmp_path / "s.toml")
        assert names == [f'thing "{k}"' for k in range(count)]
        for name in ("kind", "center", "mask", "start", "goal", "lower", "upper", "table_lower", "table_upper", "yaw"):
            np.testing.assert_allclose(getattr(back, name), getattr(scene, name), atol=2e-6, err_msg=name)
        np.testing.assert_allclose(back.size[:count], scene.size[:count], atol=2e-6)
        np.testing.assert_allclose(back.radius[:count], scene.radius[:count], atol=2e-6)
    assert scene_of(str(tmp_path / "s.toml")).mask.sum() == 4
    np.testing.assert_array_equal(scene_of("clutter", 3).center, scene_named("clutter", 3).center)


def test_what_a_file_leaves_out_is_the_papers(tmp_path: Path) -> None:
    (tmp_path / "s.toml").write_text(
        '[[obstacles]]\nshape = "column"\ncenter = [0.1, 0.2, 0.1]\nradius = 0.03\nheight = 0.2\n'
    )
    scene, names = read_scene(tmp_path / "s.toml")
    assert names == ["obstacle 1"]
    np.testing.assert_array_equal(scene.start, robotica().start)
    np.testing.assert_allclose(scene.size[0], [0.03, 0.03, 0.1])


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("start = [1, 2]", "start is"),
        ("begin = 3", "unknown key 'begin'"),
        ("obstacles = 3", "obstacles are tables"),
        ("start = [1, 2, nan]", "three numbers|3 numbers"),
        ('[[obstacles]]\nshape = "cone"', "obstacle 1 has the shape 'cone'"),
        ('[[obstacles]]\nshape = "sphere"\ncenter = [0, 0, 0]', "lacks radius"),
        ('[[obstacles]]\nshape = "sphere"\ncenter = [0, 0, 0]\nradius = 0.1\nyaw = 1', "has no yaw"),
        ('[[obstacles]]\nshape = "sphere"\ncenter = [0, 0, 0]\nradius = -0.1', "above 0"),
        ('[[obstacles]]\nshape = "sphere"\ncenter = [0, 0, 0]\nradius = "x"', "radius of obstacle 1"),
        ("start = [", "scene "),
    ],
)
def test_errors_are_one_line(tmp_path: Path, text: str, words: str) -> None:
    (tmp_path / "s.toml").write_text(text)
    with pytest.raises(UsageError, match=words) as error:
        read_scene(tmp_path / "s.toml")
    assert "\n" not in str(error.value)
    with pytest.raises(UsageError, match="No such file"):
        read_scene(tmp_path / "none.toml")
