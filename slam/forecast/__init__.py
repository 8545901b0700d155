"""Forecasts of doors: P(open at t), given the door's habits and, if there is one, the last look."""
