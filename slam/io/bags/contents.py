"""The topics of a ROS recording, without reading its messages."""

from __future__ import annotations

from typing import Any

from slam.io.bags.bag import open_bag
from slam.io.bags.laser_scan import LASER
from slam.io.files import AnyPath
from slam.io.warnings import WarningCounter


def contents_of(path: AnyPath) -> dict[str, Any]:
    """By name: ros ("ROS 1" or "ROS 2"), recorded_s (s from the first message to the last), and
    topics, each with topic, type and messages (how many). Raises InputError."""
    with open_bag(path, WarningCounter("message")) as bag:
        return {
            "ros": f"ROS {bag.ros}",
            "recorded_s": bag.seconds,
            "topics": [
                {"topic": topic.name, "type": topic.kind, "messages": topic.messages}
                for topic in bag.topics.values()
            ],
        }


def laser_topics(contents: dict[str, Any]) -> list[str]:
    """The topics of `contents_of` that hold LaserScans."""
    return [
        topic["topic"]
        for topic in contents["topics"]
        if topic["type"] == LASER and topic["messages"]
    ]
