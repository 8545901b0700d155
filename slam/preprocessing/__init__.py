"""What is done to a recording before SLAM: deskewing, odometry from the laser."""
