"""Places that cannot be written to, and results begun in an empty file."""

import errno
import os
import tempfile

import pytest

from hrcjax.lab.errors import UsageError
from hrcjax.lab.rows import read_results
from hrcjax.lab.writable import check_writable


def test_a_folder_that_is_there_or_can_be_made_passes_and_stays_as_it_was(tmp_path) -> None:
    check_writable(tmp_path, "--output")
    check_writable(tmp_path / "new" / "deep", "--output")
    assert list(tmp_path.iterdir()) == []


def test_a_file_on_the_way_is_named(tmp_path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(UsageError, match=r"file is not a folder; give another --json"):
        check_writable(tmp_path / "file" / "deep", "--json")


def test_a_folder_that_takes_no_file_is_named(tmp_path, monkeypatch) -> None:
    def refused(**_):
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))

    monkeypatch.setattr(tempfile, "TemporaryFile", refused)  # rights do not bind root
    with pytest.raises(UsageError, match="Permission denied") as error:
        check_writable(tmp_path / "new", "--output")
    assert "\n" not in str(error.value)


@pytest.mark.skipif(os.geteuid() == 0, reason="rights do not bind root")
def test_a_folder_without_the_right_to_write(tmp_path) -> None:
    (tmp_path / "shut").mkdir(mode=0o555)
    with pytest.raises(UsageError, match="Permission denied"):
        check_writable(tmp_path / "shut" / "new", "--output")


@pytest.mark.parametrize("text", ["", "\n", "{}"])
def test_an_empty_file_has_no_results_yet(tmp_path, text) -> None:
    (tmp_path / "a.json").write_text(text)
    assert read_results(tmp_path / "a.json") == {} == read_results(tmp_path / "absent.json")
    (tmp_path / "a.json").write_text("[1")
    with pytest.raises(UsageError, match="is not valid JSON"):
        read_results(tmp_path / "a.json")
