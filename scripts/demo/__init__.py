"""The command demo: the paper's experiment."""
