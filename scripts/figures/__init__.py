"""Figures, films and Rerun files: one file per kind of picture."""
