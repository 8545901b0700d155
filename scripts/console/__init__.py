"""The terminal: progress, selections, interrupts, exit statuses."""
