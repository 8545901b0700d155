"""The first bytes of the files that hold ROS recordings."""

ROS1 = b"#ROSBAG V"
MCAP = b"\x89MCAP0\r\n"
SQLITE = b"SQLite format 3\0"
