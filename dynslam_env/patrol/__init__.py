"""The task of keeping map and pose accurate in a place that changes: `DoorPatrol-v0`."""
