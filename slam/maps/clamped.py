"""Clamped map: log-odds that cannot grow beyond a limit, so that a cell can change its mind."""

from __future__ import annotations

from slam.maps.log_odds import Evidence
from slam.maps.rays import Rays
from slam.maps.static import Static


def Clamped(  # noqa: N802 - reads as the map model that it makes
    resolution: float = 0.05,
    evidence: Evidence = Evidence(),
    rays: Rays = Rays(),
    limit: float = 2.0,
) -> Static:
    """A static map whose log-odds are clamped to +- `limit` nats (Yguel et al. 2007)."""
    return Static(resolution, evidence, rays, limit)
