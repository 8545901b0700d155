"""Agents that choose goals on the map and drive to them."""
