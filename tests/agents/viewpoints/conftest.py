"""Floors that several tests share: drawing one takes seconds."""

from __future__ import annotations

import pytest

from agents.viewpoints.floors import Floors, draw_floors
from dynslam_env.worlds.office import Office


@pytest.fixture(scope="session")
def floors() -> Floors:
    """Two offices of the split train."""
    return draw_floors(Office(), "train", 0, 2)
