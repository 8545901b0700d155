"""Exit statuses of the command, as shells and other tools use them."""

EXIT_FOUND = 1
EXIT_MISTAKE = 2
EXIT_INTERRUPTED = 130
EXIT_PIPE = 141
