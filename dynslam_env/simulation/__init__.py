"""The simulated world: physics, robot, doors, people."""
