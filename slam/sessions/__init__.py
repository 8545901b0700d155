"""Saved maps: continue mapping, or localise in them."""
