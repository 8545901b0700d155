"""Driving by keyboard: keys, view, drive, texts over the picture."""
