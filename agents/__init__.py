"""What drives the robot; every agent has stable-baselines3 `predict`."""
