"""The folder of a map: what is written there, and what may be replaced."""

from pathlib import Path

from hrcjax.lab.atomic import remove_temporaries, storage_errors
from hrcjax.lab.errors import UsageError
from hrcjax.lab.run_folder import folder_name, own_files
from hrcjax.lab.writable import check_writable

MAP, POINTS, STATISTICS = "map.npz", "cloud.ply", "statistics.json"
FIGURES = ("slices.png", "bound.png", "cloud.png")
OWN = (MAP, POINTS, STATISTICS, *FIGURES)


def default_folder(recording: Path) -> Path:
    """The folder for a recording, beside other runs."""
    path = recording.resolve()
    return Path("runs") / folder_name(f"map-{path.stem if path.is_file() else path.name}")


def check_folder(folder: Path, overwrite: bool) -> None:
    """Refuses a folder that cannot be written, or in which results would replace others.

    Raises:
        UsageError: a map is there and may not be replaced; other files are there and no map; it takes no file.
    """
    check_writable(folder, "--output")
    own = own_files(folder, OWN, (), "map", "--output")
    if own and not overwrite:
        raise UsageError(f"{folder} holds a map ({own[0]}): give another --output, or --overwrite to replace it")


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
