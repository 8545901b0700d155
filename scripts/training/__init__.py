"""Commands on agents: train, evaluate, curves."""
