"""SLAM systems outside of dynslam: adapters, their programs, the trajectories they write."""
