"""`dynslam evaluate`: agents on the same patrols."""
