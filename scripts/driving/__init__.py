"""Driving by keyboard: keys, what is looked at, the drive itself, what is written over it."""
