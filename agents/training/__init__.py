"""How policies are trained, and how they go on after a break. Needs `dynslam[train]`."""

import os

# Read when torch is loaded: its threads are not to spin, for the worlds need the cores meanwhile.
os.environ.setdefault("OMP_WAIT_POLICY", "passive")
