"""The report of a bench: tables, figures and replays, as a page and as files for a paper."""
