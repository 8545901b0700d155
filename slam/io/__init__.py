"""Readers and writers of the files that people bring and take away."""
