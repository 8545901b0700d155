"""How a world is drawn: the truth, and beside it what a SLAM believes."""
