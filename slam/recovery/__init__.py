"""Noticing that the robot is lost, and finding it again."""
