"""The parts of graph SLAM: local maps, the loops between them, and the graph that holds them."""
