"""Readings of a scan: log p(scan | pose, h)."""
