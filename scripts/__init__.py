"""The `dynslam` command, one file a subcommand; imported as `dynslam_cli`."""
