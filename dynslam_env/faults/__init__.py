"""Faults of the wheels, the laser, and of the robot's place, which a SLAM must notice."""
