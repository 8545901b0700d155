"""Preprocessing of recordings: deskewing, odometry from the laser."""
