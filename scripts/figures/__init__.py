"""The pictures of `dynslam`: one file each, each function gives a figure and saves nothing."""
