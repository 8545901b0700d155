"""That a day's run would notice a leak, and that each kind of work works."""

import itertools

import pytest

from tests.day import day


@pytest.mark.parametrize(
    ("kept", "result", "flat"), [(2, 0, True), (200, 0, False), (200, 200_000, True)]
)
def test_a_leak_is_found_beside_results(kept: int, result: int, flat: bool) -> None:
    held: list[bytearray] = []

    def work():
        for _ in itertools.count():
            held.append(bytearray(b"x" * 200_000))
            del held[:-kept]
            yield result

    told = list(day.parts(work(), 100))
    assert [part.done for part in told] == list(range(10, 101, 10))
    assert (told[-1].grown(told[0]) < day.FLAT_MB) == flat


def test_a_drive_there_and_back_goes_on_without_a_leap(monkeypatch) -> None:
    monkeypatch.setattr(day, "DRIVE_SCANS", 30)
    monkeypatch.setattr(day, "LOST_M", 0.05)
    assert sum(1 for _ in itertools.islice(day.scans("static-ml"), 150)) == 150


def test_steps_and_evaluations(monkeypatch) -> None:
    monkeypatch.setattr(day, "PATROL_STEPS", 2)
    assert sum(1 for _ in itertools.islice(day.steps(), 50)) == 50
    assert sum(1 for _ in itertools.islice(day.evaluations(), 2)) == 2
