"""The folder of a run: a default name that every file system takes, and what is in it already."""

import os
from pathlib import Path

import pytest

from hrcjax.lab.errors import UsageError
from hrcjax.lab.run_folder import LONGEST, folder_name, own_files
from hrcjax.lab.writable import check_writable


@pytest.mark.parametrize("letter", ["x", "中", "\udce4", "a/"])
def test_long_names_are_cut_and_told_apart(letter: str, tmp_path: Path) -> None:
    names = [folder_name(letter * 400), folder_name(letter * 401)]
    for name in names:
        (tmp_path / name).mkdir()
        assert 9 <= len(os.fsencode(name)) <= LONGEST
    assert len(list(tmp_path.iterdir())) == 2
    assert folder_name("map-kitchen") == "map-kitchen"


def test_a_name_that_is_too_long_names_the_option(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=r"File name too long .*; give another --out"):
        check_writable(tmp_path / ("x" * 300) / "y", "--out")
    check_writable(tmp_path / ("x" * 255) / "y", "--out")
    (tmp_path / "file").write_text("")
    with pytest.raises(UsageError, match=r"file is a file, not a folder; give another --out"):
        check_writable(tmp_path / "file", "--out")
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_own_files_of_others_and_of_a_run(tmp_path: Path) -> None:
    def own(known: tuple[str, ...] = ()) -> list[str]:
        return own_files(tmp_path / "r", ("map.npz", "cloud.ply"), known, "map", "--output")

    assert own() == []
    (tmp_path / "r").mkdir()
    (tmp_path / "r" / ".tmp-1-map.npz").write_text("")
    assert own() == []
    (tmp_path / "r" / "thesis.tex").write_text("")
    with pytest.raises(UsageError, match=r"holds other files \(thesis.tex\) and no map; give another --output"):
        own()
    assert own(known=("thesis.tex",)) == []
    (tmp_path / "r" / "map.npz").write_text("")
    assert own() == ["map.npz"]
