"""Agents that choose among viewpoints of doors: one table for all, they differ in the choice."""
