"""The task of keeping a map and a pose right in a place that changes: `DoorPatrol-v0`."""
