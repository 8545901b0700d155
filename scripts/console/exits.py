"""Exit statuses of the command, as shells and other tools use them."""

EXIT_FOUND = 1  # compare: a variant became worse
EXIT_MISTAKE = 2  # an option or a file cannot be used, or not all could be written
EXIT_UNSURE = 3  # map, run: all is written, but the robot was lost, at the end or for long
EXIT_INTERRUPTED = 130
EXIT_PIPE = 141
