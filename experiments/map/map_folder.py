"""The output folder of a map: its files, and which of them may be replaced."""

from pathlib import Path

from hrcjax.lab.atomic import remove_temporaries, storage_errors
from hrcjax.lab.errors import UsageError
from hrcjax.lab.run_folder import folder_name, own_files
from hrcjax.lab.writable import check_writable

MAP, POINTS, STATISTICS = "map.npz", "cloud.ply", "statistics.json"
FIGURES = ("slices.png", "bound.png", "cloud.png")
OWN = (MAP, POINTS, STATISTICS, *FIGURES)


def default_folder(recording: Path) -> Path:
    """Default folder for a recording."""
    path = recording.resolve()
    return Path("runs") / folder_name(f"map-{path.stem if path.is_file() else path.name}")


def check_folder(folder: Path, overwrite: bool) -> None:
    """Refuses a folder that cannot be written, or in which results would be overwritten.

    Raises:
        UsageError: the folder holds a map and `overwrite` is not set; it holds other files and no map; it is not writable.
    """
    check_writable(folder, "--output")
    own = own_files(folder, OWN, (), "map", "--output")
    if own and not overwrite:
        raise UsageError(f"{folder} already holds a map ({own[0]}): choose another --output, or --overwrite")


def prepare_folder(folder: Path) -> None:
    """Creates the folder, or removes the results of an earlier run from it, and no other files.

    Raises:
        StorageError: it cannot be created or written.
    """
    with storage_errors(folder):
        folder.mkdir(parents=True, exist_ok=True)
    remove_temporaries(folder)
    for name in OWN:
        if name != MAP:  # replaced as a whole when the new one is there
            with storage_errors(folder / name):
                (folder / name).unlink(missing_ok=True)
