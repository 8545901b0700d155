"""The parts of graph SLAM: local maps, loop closure and the pose graph."""
