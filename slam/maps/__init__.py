"""Map models: each makes h, the probability that a cell is occupied now, of what it saw."""
