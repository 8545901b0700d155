"""ROS recordings, without ROS: ROS 1 bags, and ROS 2 bags as a folder, .mcap or .db3."""

from slam.io.bags.read import read_bag, read_reference
from slam.io.bags.result import write_result
from slam.io.bags.write import write_bag

__all__ = ["read_bag", "read_reference", "write_bag", "write_result"]
