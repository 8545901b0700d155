"""The command speed."""
