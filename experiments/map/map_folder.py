"""The folder of a map: what is written there, and what may be replaced."""

from pathlib import Path

from hrcjax.lab.atomic import TEMPORARY, remove_temporaries, storage_errors
from hrcjax.lab.errors import UsageError
from hrcjax.lab.writable import check_writable

MAP, POINTS, STATISTICS = "map.npz", "cloud.ply", "statistics.json"
FIGURES = ("slices.png", "bound.png", "cloud.png")
OWN = (MAP, POINTS, STATISTICS, *FIGURES)


def default_folder(recording: Path) -> Path:
    """The folder for a recording, beside other runs."""
    path = recording.resolve()
    return Path("runs") / f"map-{path.stem if path.is_file() else path.name}"


def check_folder(folder: Path, overwrite: bool) -> None:
    """Refuses a folder in which results would replace others, or that cannot be written to.

    Raises:
        UsageError: a map is there and may not be replaced; other files are there and no map; it is a file; it takes no file.
    """
    if folder.exists() and not folder.is_dir():
        raise UsageError(f"{folder} is a file, not a folder: give another --output")
    check_writable(folder, "--output")
    if not folder.is_dir():
        return
    there = sorted(path.name for path in folder.iterdir() if not path.name.startswith(TEMPORARY))
    own = [name for name in there if name in OWN]
    if own and not overwrite:
        raise UsageError(f"{folder} holds a map ({own[0]}): give another --output, or --overwrite to replace it")
    if there and not own:
        raise UsageError(f"{folder} holds other files ({there[0]}) and no map: give another --output")


def prepare_folder(folder: Path) -> None:
    """Makes the folder, or removes from it the results of an earlier run, and nothing else.

    Raises:
        StorageError: it cannot be made or written.
    """
    with storage_errors(folder):
        folder.mkdir(parents=True, exist_ok=True)
    remove_temporaries(folder)
    for name in OWN:
        if name != MAP:  # replaced as a whole when the new one is there
            with storage_errors(folder / name):
                (folder / name).unlink(missing_ok=True)
