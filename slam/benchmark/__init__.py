"""Variants x episodes -> results -> statistics."""
