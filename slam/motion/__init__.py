"""Motion models: how far the odometry may be off."""
