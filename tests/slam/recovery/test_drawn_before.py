"""A single map keeps what it showed some stretches before, and tells drifts and other places by
it."""

import math
from dataclasses import replace

import numpy as np
import pytest

from slam.algorithms.maximum_likelihood import MaximumLikelihood
from slam.geometry import Pose2
from slam.maps.static import Static
from slam.recovery import drawn_before
from slam.recovery.drawn_before import STEP as LOOKS
from slam.recovery.drawn_before import STRETCH, DrawnBefore
from slam.recovery.old_ground import RECENT
from slam.recovery.watch import MISPLACED, Watch
from slam.scan import Scan
from slam.sensor_models.endpoint import Endpoint

BEAMS = np.linspace(-math.pi, math.pi, 361)
STEP = 0.5  # m between keyframes


def hall(x: float, long: float = 60.0) -> Scan:
    """Seen at x, m, from within a hall 4 m wide with pillars each some metres along its walls."""
    pillars = np.cumsum(np.random.default_rng(1).uniform(1.0, 5.0, 30)) - 10.0
    ranges = np.full(len(BEAMS), 12.0)
    for k, angle in enumerate(BEAMS):
        c, s = math.cos(angle), math.sin(angle)
        wall = 2.0 / max(abs(s), 1e-9)
        ends = [(long - x) / c if c > 0 else (-10.0 - x) / min(c, -1e-9)]
        for pillar in pillars:
            along = (pillar - 0.2 - x) / c if c > 0 else (pillar + 0.2 - x) / min(c, -1e-9)
            if along > 0 and 1.6 <= abs(along * s) <= 2.0:
                ends.append(along)
        ranges[k] = min(wall, *ends, 12.0)
    return Scan(ranges, BEAMS, 12.0)


class Recorder:
    """A map, its field, and what was drawn before; keyframes along the hall."""

    def __init__(self) -> None:
        self.map, self.field = Static(), Endpoint()
        self.before: DrawnBefore | None = None

    def draw(self, x: float, at: Pose2, *, moves: bool = True) -> None:
        """Draw the scan seen at x as if it were seen at a pose."""
        scan = hall(x)
        changed = self.map.integrate(scan, at)
        if self.before is not None and moves:
            self.before.add(scan, at)
        self.field.refresh(self.map, changed)
        self.before = self.before or DrawnBefore(self.field)
        self.before.note()

    def explained(self, x: float, at: Pose2) -> float:
        """The share of the scan that the old field explains."""
        assert self.before is not None
        return self.before.endpoint.shares(hall(x).points, at)[0]


def driven(end: float, start: float = 0.0, aside: float = 0.0) -> Recorder:
    recorder = Recorder()
    for x in np.arange(start, end, STEP):
        recorder.draw(x, Pose2(x, aside))
    return recorder


def on_known_ground() -> tuple[Recorder, DrawnBefore]:
    """In a hall that was mapped for 44 m; the first half is old."""
    recorder = driven((RECENT + 6) * STRETCH)
    assert recorder.before is not None
    recorder.before.forget()
    return recorder, recorder.before


def test_what_is_drawn_becomes_old_after_some_stretches() -> None:
    early = driven((RECENT - 1) * STRETCH)
    assert early.explained(15.0, Pose2(15.0)) < 0.2
    late = driven((RECENT + 7) * STRETCH)
    assert late.explained(15.0, Pose2(15.0)) > 0.9
    assert late.explained(45.0, Pose2(45.0)) < 0.2


def test_a_saved_map_is_old_at_once() -> None:
    recorder = Recorder()
    for x in np.arange(0.0, 10.0, STEP):
        recorder.draw(x, Pose2(x), moves=False)
    assert recorder.explained(5.0, Pose2(5.0)) > 0.9


def test_after_a_dropped_doubt_all_that_was_drawn_is_old() -> None:
    recorder = driven(2 * STRETCH)
    before = recorder.before
    assert before is not None
    assert recorder.explained(6.0, Pose2(6.0)) < 0.2
    before.doubt()
    assert before.open
    assert recorder.explained(6.0, Pose2(6.0)) > 0.9
    for x in np.arange(2 * STRETCH, (RECENT + 6) * STRETCH, STEP):
        recorder.draw(x, Pose2(x))
    assert recorder.explained(15.0, Pose2(15.0)) < 0.2  # drawn since then
    before.settle()
    for x in np.arange((RECENT + 6) * STRETCH, (RECENT + 8) * STRETCH, STEP):
        recorder.draw(x, Pose2(x))
    assert recorder.explained(15.0, Pose2(15.0)) > 0.9


def test_what_is_suspected_does_not_become_old_by_a_dropped_doubt() -> None:
    recorder = driven(2 * STRETCH)
    before = recorder.before
    assert before is not None
    before._judge.votes = 1
    before.doubt()
    assert (before.open, before.votes) == (True, 1)
    assert recorder.explained(6.0, Pose2(6.0)) < 0.2


def test_a_copy_of_the_field_does_not_change_with_the_map() -> None:
    recorder = driven((RECENT + 3) * STRETCH)
    before = recorder.explained(0.0, Pose2())
    assert recorder.before is not None
    recorder.before.forget()
    for _ in range(20):  # another hall beside the first one, without a metre driven
        recorder.draw(0.0, Pose2(0.0, 0.7))
    assert recorder.explained(0.0, Pose2()) == before > 0.9
    assert recorder.field.shares(hall(0.0).points, Pose2())[0] < 0.9


def test_a_drift_is_told_though_the_map_hides_it() -> None:
    recorder, before = on_known_ground()
    drift = Pose2(0.0, 0.3, 0.0)
    for x in np.arange(2.0, 8.0, STEP):  # the second time, drawn beside the first
        recorder.draw(x, drift @ Pose2(x))
        if before.drift is not None:
            break
    assert before.drift is not None
    found = before.drift @ drift
    assert found.y == pytest.approx(0.0, abs=0.03)
    assert found.theta == pytest.approx(0.0, abs=0.01)
    assert before.votes == 0


@pytest.mark.parametrize("aside", [0.02, 0.08])
def test_without_a_drift_none_is_told(aside: float) -> None:
    recorder, before = on_known_ground()
    for x in np.arange(2.0, 12.0, STEP):
        recorder.draw(x, Pose2(x, aside))
        assert before.drift is None


def half_known(before: DrawnBefore, aside: float) -> None:
    """As a loop closes: the old field explains two thirds of what it knows, where it is right."""

    def unexplained(pose: Pose2, scan: Scan) -> float:
        return 0.3 if abs(pose.y) < aside / 2 else 1.0

    before._unexplained_at = unexplained  # pyright: ignore[reportAttributeAccessIssue]


def test_where_a_loop_closes_two_looks_must_find_the_same_drift() -> None:
    recorder, before = on_known_ground()
    half_known(before, 0.3)
    told = []
    for x in np.arange(2.0, 8.0, STEP):
        recorder.draw(x, Pose2(x, 0.3))
        if before.drift is not None:
            told.append(x)
    assert told[0] == pytest.approx(2.0 + 2.0 * LOOKS)  # at the first look the old field knows it
    recorder, before = on_known_ground()
    half_known(before, 0.3)
    for k, x in enumerate(np.arange(2.0, 8.0, STEP)):  # each look finds another one
        recorder.draw(x, Pose2(x, 0.3 if k // 2 % 2 else 0.6))
        assert before.drift is None


def test_what_a_look_found_counts_at_the_next_one_only() -> None:
    recorder, before = on_known_ground()
    half_known(before, 0.3)
    for k, x in enumerate(np.arange(2.0, 8.0, STEP)):  # every other look fits
        recorder.draw(x, Pose2(x, 0.3 if k // 2 % 2 else 0.0))
        assert before.drift is None


def test_a_drift_that_is_corrected_is_forgotten() -> None:
    _, before = on_known_ground()
    for forgets in (before.forget, lambda: before.move(Pose2())):
        before._likely = Pose2(0.0, 0.3)
        forgets()
        assert before._likely is None


def test_the_drift_of_the_last_look_is_tried_again(monkeypatch: pytest.MonkeyPatch) -> None:
    recorder, before = on_known_ground()
    half_known(before, 0.3)
    for k, x in enumerate(np.arange(2.0, 2.0 + 2.0 * LOOKS + STEP, STEP)):
        if k * STEP > LOOKS:  # the coarse search finds another place along the hall
            monkeypatch.setattr(
                drawn_before, "best_near", lambda *given: given[2] @ Pose2(0.9, -0.3)
            )
        recorder.draw(x, Pose2(x, 0.3))
    assert before.drift is not None
    assert before.drift.x == pytest.approx(0.0, abs=0.1)


def test_what_fits_nowhere_near_is_no_drift() -> None:
    recorder, before = on_known_ground()
    for x in np.arange(2.0, 12.0, STEP):  # turned round, in a hall that has other pillars
        recorder.draw(x + 20.0, Pose2(x, 0.0, 0.3))
        assert before.drift is None


def test_a_robot_that_draws_another_place_over_the_map_is_told_so() -> None:
    recorder, before = on_known_ground()
    for x in np.arange(0.0, 24.0, STEP):  # it is 10 m farther on than it believes
        recorder.draw(x + 10.0, Pose2(x))
    assert before.votes >= MISPLACED
    before.forget()
    assert before.votes == 0
    for x in np.arange(24.0, 30.0, STEP):
        recorder.draw(x, Pose2(x))
    assert before.votes == 0


def test_a_robot_that_stands_keeps_what_it_saw() -> None:
    recorder = driven((RECENT + 6) * STRETCH)
    before = recorder.before
    assert before is not None
    path = before.last(0).points
    for _ in range(200):
        before.add(hall(before.frame.x), before.frame)
    np.testing.assert_array_equal(before.last(0).points, path)


def driven_slam() -> MaximumLikelihood:
    slam = MaximumLikelihood(watch=Watch())
    for x in np.arange(0.0, 6.0, STEP):
        slam.update(Pose2(STEP if x else 0.0), hall(x))
    return slam


def test_the_robot_is_moved_by_the_drift_once() -> None:
    slam, by = driven_slam(), Pose2(0.0, 0.5)
    before = slam._before
    assert before is not None
    before.drift = by
    last = before.frame
    assert slam.update(Pose2(STEP), hall(6.0)).pose.y == pytest.approx(0.5, abs=0.05)
    assert before.drift is None
    assert slam.watch is not None
    assert slam.watch.odometry._last == math.inf  # the next fit is compared with none
    assert before._drawn[-2].keyframe.pose.y == pytest.approx(last.y + 0.5)


def test_where_the_robot_is_placed_no_drift_is_known() -> None:
    slam = driven_slam()
    assert slam._before is not None
    slam._before.drift = Pose2(0.0, 0.5)
    slam.place(Pose2(5.5))
    assert slam._before.drift is None


def test_a_misplaced_robot_is_searched_for_in_the_old_map() -> None:
    slam = driven_slam()
    before = slam._before
    assert before is not None
    assert slam._surroundings().endpoint is slam.sensor_model
    before._judge.votes = MISPLACED
    assert slam._surroundings().endpoint is before.endpoint


def test_only_a_slam_that_is_watched_keeps_it() -> None:
    alone = MaximumLikelihood()
    for x in np.arange(0.0, 3.0, STEP):
        alone.update(Pose2(STEP if x else 0.0), hall(x))
    assert alone._before is None
    assert driven_slam()._before is not None


def test_a_drift_is_told_at_the_scan_at_which_it_is_taken_out_alone(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    robot, drifts = MaximumLikelihood(watch=Watch()), [Pose2(0.0, 0.02)]
    monkeypatch.setattr(DrawnBefore, "take_drift", lambda self: drifts.pop() if drifts else None)
    robot.update(Pose2(), hall(0.0))
    before = robot.update(Pose2(0.5), replace(hall(0.5), time=1.0))
    after = robot.update(Pose2(), replace(hall(0.5), time=1.1))
    assert before.drift == pytest.approx(0.02)
    assert not after.matched
    assert after.drift == 0.0
