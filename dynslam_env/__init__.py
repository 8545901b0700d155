"""Gymnasium environments of places that change."""
