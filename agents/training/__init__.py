"""Training of policies, with checkpoints to resume from. Needs `dynslam[train]`."""

import os

# Read when torch is loaded: idle threads must not spin, since the environments need the cores.
os.environ.setdefault("OMP_WAIT_POLICY", "passive")
