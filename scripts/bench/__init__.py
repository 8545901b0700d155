"""The benchmark: suites of drives and logs, run by processes that may die, kept line by line."""
