"""A cluster is tested by a bench that runs on it."""

from ..bench.conftest import bench, cache_folder

__all__ = ["bench", "cache_folder"]
