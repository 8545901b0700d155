"""Pose searches: the argmax of the posterior (equation 7)."""
