"""Figures of a run, copied beside the page that shows them."""

from collections.abc import Sequence
from pathlib import Path

from hrcjax.lab.atomic import write_bytes


def copy_figures(folder: Path, page: Path, names: Sequence[str], program: str) -> list[str]:
    """Copies figures into the folder `figures` beside a page, each with the program's name in front; their places from the page.

    Args:
        folder: where they are.
        names: of their files. An MP4, which a page does not show, stays where it is.

    Raises:
        StorageError: one of them cannot be written.
    """
    place = page.parent / "figures"
    shown = [name for name in names if not name.endswith(".mp4")]
    if shown:
        place.mkdir(exist_ok=True)
    for name in shown:
        write_bytes(place / f"{program}-{name}", (folder / name).read_bytes())
    return [f"figures/{program}-{name}" for name in shown]
