"""Rendering: the true world, and beside it the map and poses of a SLAM."""
