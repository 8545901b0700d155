"""The page of a bench: tables, figures, replays; and the same as files for a paper."""
