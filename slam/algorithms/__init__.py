"""Whole SLAM algorithms, made of the parts beside them."""
