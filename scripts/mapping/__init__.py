"""Commands that make maps of recordings: map, run."""
