"""Readers and writers of recordings, maps, trajectories and layers."""
