"""Worlds, one per file; each draws a FloorPlan and converts it to a Layout."""
