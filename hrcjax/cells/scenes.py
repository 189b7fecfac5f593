"""A scene by its name, or from a file of named shapes."""

from pathlib import Path

from hrcjax.io.scene_file import read_scene
from hrcjax.world import Scene, scene_named


def is_scene_file(name: str) -> bool:
    """Whether a value of `--scene` is a file."""
    return name.lower().endswith(".toml")


def scene_of(name: str, seed: int = 0) -> Scene:
    """The scene of a name, or of a TOML file.

    Raises:
        ValueError: an unknown name, or a file that is no scene.
    """
    return read_scene(Path(name))[0] if is_scene_file(name) else scene_named(name, seed)
