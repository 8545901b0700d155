"""How policies are trained, and how they go on after a break. Needs `dynslam[train]`."""
