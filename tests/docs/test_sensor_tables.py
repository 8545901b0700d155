"""The tables of docs/sensors.md: what they count, by hand."""

import math
from typing import Any

import numpy as np
import pytest

from docs.making import laser_check, sensor_costs
from docs.making.laser_check import Drive, simulated, statistics
from dynslam_env import EchoLoss, Laser, MixedPixels, Quantisation

ANGLES = np.radians(np.arange(-20, 21))


def drive(rows, poses):
    return Drive(np.array(rows), np.array(poses, dtype=float), ANGLES)


def scene(between: float, again: float):
    """Two scans of a pillar at 2 m before a wall at 5 m, the second from 0.4 m aside: the first
    has a beam between the two, and the second measures `again` there."""
    first = np.full(41, 5.0)
    first[:20], first[20] = 2.0, between
    return drive([first, np.full(41, again)], [(0.0, 0.0, 0.0), (0.0, 0.4, 0.0)])


def test_a_reading_through_which_a_later_scan_sees_is_a_mixed_pixel():
    found = statistics([scene(3.0, 5.0)], [])
    assert found.edges == [0, 0, 0, 1]
    assert found.between == [0.0, 0.0, 0.0, 1.0]
    assert found.mixed.tolist() == [0.0, 0.0, 0.0, 1.0]


def test_a_reading_that_a_later_scan_confirms_is_none():
    found = statistics([scene(3.0, math.hypot(3.0, 0.4))], [])
    assert found.between[3] == 1.0
    assert found.mixed[3] == 0.0


def test_an_edge_without_a_reading_between_counts():
    found = statistics([scene(2.0, 5.0)], [])
    assert found.edges[3] == 1
    assert found.mixed[3] == 0.0


def test_lost_echoes_are_those_between_two_on_one_surface():
    row = np.full(41, 3.0)
    row[10] = math.inf
    row[30:] = math.inf
    found = statistics([drive([row], [(0.0, 0.0, 0.0)])], [])
    assert found.no_echo == pytest.approx(12 / 41)
    assert found.lost == pytest.approx(1 / 22)  # of beams whose four neighbours have echoes


def test_noise_is_that_of_beams_that_saw_nothing_move():
    rng = np.random.default_rng(0)
    rows = np.tile(np.linspace(0.6, 1.9, 41), (400, 1)) + 0.004 * rng.standard_normal((400, 41))
    rows[:, 5] += np.linspace(0.0, 0.5, 400)
    found = statistics([drive(rows[:1], [(0.0, 0.0, 0.0)])], [rows])
    assert found.noise[0] == pytest.approx(0.004, rel=0.05)
    assert math.isnan(found.noise[3])
    assert found.still == 400


def test_effects_are_found_in_simulated_drives(monkeypatch):
    monkeypatch.setattr(laser_check, "SEEDS", range(5000, 5001))
    clean = simulated(Laser(max_range=80.0, sigma=0.005), "DoorCorridor-v0")
    effects = Quantisation(0.01), MixedPixels(0.0044, 3.0), EchoLoss(share=0.01)
    real = simulated(Laser(max_range=80.0, sigma=0.005, effects=effects), "DoorCorridor-v0")
    assert clean.lost == 0.0
    assert real.lost == pytest.approx(0.01, abs=0.003)
    assert real.noise[1] == pytest.approx(math.hypot(0.005, 0.01 / math.sqrt(12)), rel=0.2)
    assert real.mixed[2] > clean.mixed[2] + 0.03
    noise = f"| noise at 2 to 4 m, mm | {1e3 * clean.noise[1]:.1f} | {1e3 * real.noise[1]:.1f} |"
    assert noise in laser_check.table({"clean": clean, "real": real})


def rows(sensor: str, errors) -> list[dict[str, Any]]:
    return [
        {"sensor": sensor, "variant": "a", "seed": k, "ate": e, "failed": math.isinf(e)}
        for k, e in enumerate(errors)
    ]


def test_costs_are_paired_by_episode():
    bare, worse = [0.01, 0.02, 0.03], [0.012, 0.022, 0.5]
    found = sensor_costs.errors_of(rows("none", bare) + rows("late", worse))
    told = sensor_costs.table(found).splitlines()
    assert told[0] == "| | `a` |"
    assert told[2] == "| none: ATE | 20.0 (10.0 to 30.0) |"
    assert told[3] == "| late | +2.0 (+2.0 to +470.0), 1 of 3 lost |"
