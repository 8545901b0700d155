"""Experiments: sources of episodes, jobs, worker processes, scores."""
