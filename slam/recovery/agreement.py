"""How well a map agrees with a scan."""

from __future__ import annotations

from typing import NamedTuple


class Agreement(NamedTuple):
    """Shares of a scan's echoes that the map explains (occupied) and contradicts (free)."""

    explained: float
    contradicted: float
