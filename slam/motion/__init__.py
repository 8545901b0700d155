"""Motion models: the error of the odometry."""
