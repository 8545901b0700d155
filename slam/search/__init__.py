"""Pose searches: the argmax of equation 7."""
