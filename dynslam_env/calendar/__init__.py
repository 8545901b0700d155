"""Worlds with a calendar: doors with habits, things that are moved, visits over weeks."""
