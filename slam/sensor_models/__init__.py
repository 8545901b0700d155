"""Sensor models: the log-likelihood log p(scan | pose, h) of a scan."""
