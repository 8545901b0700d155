"""Scores of trajectories and maps."""
