"""Commands that study one question: study, ghosts, endure."""
