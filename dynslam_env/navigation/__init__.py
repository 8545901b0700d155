"""Navigation on a map that a SLAM makes: costmap, plan, frontiers, doors found, steering."""
