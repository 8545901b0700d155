"""What a ROS recording holds, without reading its messages."""

from __future__ import annotations

from typing import Any

from slam.io.bags.file import opened
from slam.io.files import AnyPath
from slam.io.warnings import WarningCounter


def contents_of(path: AnyPath) -> dict[str, Any]:
    """ros ("ROS 1" or "ROS 2"), recorded_s, and topics, each with topic, type and messages.

    Raises InputError.
    """
    with opened(path, WarningCounter("message")) as bag:
        return {
            "ros": f"ROS {bag.ros}",
            "recorded_s": bag.seconds,
            "topics": [
                {"topic": topic.name, "type": topic.kind, "messages": topic.messages}
                for topic in bag.topics.values()
            ],
        }
