"""Clamped map: log-odds within limits, so that a cell can change its state quickly."""

from __future__ import annotations

from slam.maps.log_odds import Evidence
from slam.maps.rays import Rays
from slam.maps.static import Static


def Clamped(  # noqa: N802 - named like the map models
    resolution: float = 0.05,
    evidence: Evidence = Evidence(),
    rays: Rays = Rays(),
    limit: float = 2.0,
) -> Static:
    """A static map whose log-odds are clamped to +- `limit` nats (Yguel et al. 2007)."""
    return Static(resolution, evidence, rays, limit)
