"""Experiments: sources of episodes, jobs, worker processes, batches, scores."""
