"""Ways to choose the next viewpoint, one a file."""
