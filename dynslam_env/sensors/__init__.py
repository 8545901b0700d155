"""Laser and odometry."""
