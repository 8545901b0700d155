"""map.html: a map in a browser, to look at, to play the drive in, and to correct."""
