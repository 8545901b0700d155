"""Navigation on a SLAM's map: costmap, planner, frontiers, doors found, path following."""
