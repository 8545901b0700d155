"""SLAM algorithms, assembled from map, sensor and motion models and a search."""
