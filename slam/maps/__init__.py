"""Map models: h, the probability that a cell is occupied now, from the scans integrated so far."""
