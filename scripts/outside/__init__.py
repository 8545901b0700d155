"""SLAM systems outside of dynslam, run as programs: adapters, their programs, their trajectories."""
