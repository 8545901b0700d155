"""The worlds, one a file; each draws a FloorPlan and makes a Layout of it."""
