"""ROS 1 and ROS 2 bags, opened by the library rosbags, an optional dependency."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from hrcjax.lab.errors import UsageError

ACCEPTED = (
    "a whole ROS 1 bag (*.bag, or a folder of its parts) or ROS 2 bag (a folder with metadata.yaml, *.mcap, *.db3)"
)
BAG_SUFFIXES = (".bag", ".mcap", ".db3")


class Bag:
    """An open bag: topics by name, and messages."""

    def __init__(self, path: Path, reader: Any) -> None:
        self.path = path
        self._reader = reader
        self.types: dict[str, str] = {c.topic: c.msgtype for c in reader.connections}
        self.counts: dict[str, int] = {name: topic.msgcount for name, topic in reader.topics.items()}

    def of_type(self, *types: str) -> list[str]:
        """Names of the topics of these types, such as sensor_msgs/msg/Image, that hold a message; sorted."""
        return sorted(name for name, kind in self.types.items() if kind in types and self.counts[name])

    def messages(self, *topics: str) -> Iterator[tuple[str, Any]]:
        """Topic and message, in the order they were recorded."""
        connections = [c for c in self._reader.connections if c.topic in topics]
        if connections:  # without any the library would read all
            for connection, _, raw in self._reader.messages(connections=connections):
                yield connection.topic, self._reader.deserialize(raw, connection.msgtype)

    def first(self, topic: str) -> Any:
        """The first message of a topic."""
        return next(self.messages(topic))[1]


@contextmanager
def opened_bag(paths: list[Path]) -> Iterator[Bag]:
    """The bag of one file or folder, or of the parts of a ROS 1 recording; closed at the end.

    Raises:
        UsageError: the library is not installed; the bag is missing or broken, also if detected while reading.
    """
    try:
        from rosbags.highlevel import AnyReader
        from rosbags.typesys import Stores, get_typestore
    except ImportError:
        raise UsageError("reading ROS bags needs the library rosbags: pip install hrcjax[bags]") from None
    path = paths[0]
    try:
        # Some ROS 2 bags have no message definitions; those of the messages read here never changed.
        with AnyReader(paths, default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
            yield Bag(path, reader)
    except UsageError:
        raise
    except FileNotFoundError:
        raise UsageError(f"no bag at {path}: accepted is {ACCEPTED}") from None
    except Exception as error:  # databases, archives and text files raise errors of many types
        detail = " ".join(str(error).split()) or type(error).__name__
        raise UsageError(f"bag {path} cannot be read ({detail}): accepted is {ACCEPTED}") from error
