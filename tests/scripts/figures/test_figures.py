# pyright: reportMissingImports=false
from itertools import pairwise

import numpy as np
import pytest
from dynslam_cli.figures.door_histogram import door_cell, door_histogram_figure
from dynslam_cli.figures.known_poses import mapped
from dynslam_cli.figures.likelihood import (
    RANGE,
    LikelihoodSurface,
    likelihood_figure,
    surface,
    surprise,
)
from dynslam_cli.figures.lost_course import LostCourse, stretches
from dynslam_cli.figures.map_figure import map_figure, overview_figure
from dynslam_cli.figures.map_panel import MARGIN, Box, MapPanel, shades
from dynslam_cli.figures.replay import Snapshot, take_snapshots, write_replay
from dynslam_cli.figures.style import LOST
from PIL import Image, ImageColor, ImageSequence

import slam
from agents.scripted_path import record_corridor
from dynslam_env import Doors, Uniform
from slam.benchmark.run import run, true_start
from slam.episode import Episode, Truth
from slam.errors import InputError
from slam.geometry import Pose2
from slam.grid import GridSpec, OccupancyGrid
from slam.maps.histogram import Histogram
from slam.metrics.change import TrueOccupancy

SCANS = 60
LEGEND_PIXELS = 60  # of a figure, at its lower edge
TRUE_LINES = ["true walls", "true doors", "true path"]


def first_scans(episode: Episode, count: int = SCANS) -> Episode:
    truth = episode.truth
    assert truth is not None
    short = Truth(truth.poses[:count], truth.walls, truth.doors[:count])
    return Episode(episode.scans[:count], episode.odometry, short, episode.meta)


@pytest.fixture(scope="module")
def moving() -> Episode:
    return first_scans(record_corridor(1, Doors(Uniform(1.0, 3.0), swing_time=0.5)))


@pytest.fixture(scope="module")
def static() -> Episode:
    return first_scans(record_corridor(1, "static"))


@pytest.fixture(scope="module")
def panel(moving: Episode) -> MapPanel:
    result = run(slam.make("static-ml", true_start(moving)), moving)
    return MapPanel("a title", result.grid, result.poses, moving.truth)


@pytest.fixture(scope="module")
def runs(moving: Episode) -> dict[str, list[Snapshot]]:
    return {
        name: take_snapshots(slam.make(name, true_start(moving)), moving, every=20)
        for name in ("static-ml", "dynamic-ml")
    }


def toy_grid(occupied: np.ndarray, observed: np.ndarray) -> OccupancyGrid:
    return OccupancyGrid(GridSpec(0.1, 0, 0, *occupied.shape), occupied, observed)


def pixels(figure) -> np.ndarray:
    figure.canvas.draw()
    return np.asarray(figure.canvas.buffer_rgba()).copy()


def legend_of(figure) -> list[str]:
    return [text.get_text() for text in figure.legends[0].get_texts()]


class TestMapFigure:
    def test_names_map_truth_and_estimate(self, panel):
        figure = map_figure(panel.grid, panel.poses, panel.truth, title="a title")
        (axes,) = figure.axes
        assert axes.get_title() == "a title"
        assert legend_of(figure) == [*TRUE_LINES, "estimated path"]

    def test_shows_all_walls(self, panel):
        (axes,) = map_figure(panel.grid, panel.poses, panel.truth).axes
        x, y = panel.truth.walls.reshape(-1, 2).T
        assert axes.get_xlim()[0] <= x.min() < x.max() <= axes.get_xlim()[1]
        assert axes.get_ylim()[0] <= y.min() < y.max() <= axes.get_ylim()[1]

    def test_of_a_log_has_no_truth(self, panel):
        assert legend_of(map_figure(panel.grid, panel.poses)) == ["estimated path"]
        assert not map_figure(panel.grid).legends

    def test_marks_where_the_robot_was_lost_and_plots_the_probability(self, panel):
        probability = np.full(SCANS, 0.1)
        probability[10:20], probability[30] = 0.9, 0.6  # a stretch, a single scan
        times = 100.0 + 0.5 * np.arange(SCANS)
        figure = map_figure(panel.grid, panel.poses, lost=LostCourse(times, probability))
        assert legend_of(figure) == ["estimated path", "lost (p > 0.5)"]
        axes, below = figure.axes
        marked = axes.get_lines()[-1].get_xydata()
        assert np.flatnonzero(np.isfinite(marked[:, 0])).tolist() == [*range(10, 20), 30]
        np.testing.assert_array_equal(marked[10:20], panel.poses[10:20, :2])
        drawn = below.get_lines()[-1].get_xydata()
        np.testing.assert_allclose(drawn, np.column_stack([times - 100.0, probability]))
        (bands,) = below.collections
        ends = [path.get_extents().intervalx.tolist() for path in bands.get_paths()]
        np.testing.assert_allclose(ends, [(5.0, 10.0), (15.0, 15.5)])
        assert (pixels(figure)[..., :3] == ImageColor.getrgb(LOST)).all(axis=2).sum() > 100

    def test_a_single_scan_at_which_it_was_lost_is_seen(self, panel):
        course = LostCourse(np.arange(float(SCANS)), 0.9 * (np.arange(SCANS) == 30))
        panel = panel._replace(lost=course.lost)
        figure = overview_figure([panel._replace(lost=None), panel])
        assert legend_of(figure)[-1] == "lost (p > 0.5)"
        first, second = np.array_split(pixels(figure)[:-LEGEND_PIXELS, :, :3], 2, axis=1)
        assert not (first == ImageColor.getrgb(LOST)).all(axis=2).any()
        assert (second == ImageColor.getrgb(LOST)).all(axis=2).any()

    def test_is_as_before_where_no_one_judged(self, panel):
        course = LostCourse(np.arange(float(SCANS)), np.zeros(SCANS))
        one, two = (map_figure(panel.grid, panel.poses, lost=lost) for lost in (None, course))
        np.testing.assert_array_equal(pixels(one), pixels(two))

    def test_judged_and_never_lost_is_plotted_and_nothing_marked(self, panel):
        course = LostCourse(np.arange(float(SCANS)), np.full(SCANS, 0.5))
        figure = map_figure(panel.grid, panel.poses, lost=course)
        assert len(figure.axes) == 2
        assert legend_of(figure) == ["estimated path"]

    def test_the_plot_below_takes_nothing_from_the_map(self, panel):
        course = LostCourse(np.arange(float(SCANS)), np.full(SCANS, 0.5))
        widths = []
        for lost in (None, course):
            figure = map_figure(panel.grid, panel.poses, lost=lost)
            figure.canvas.draw()
            widths.append([axes.get_window_extent().width for axes in figure.axes])
        assert widths[1] == pytest.approx([widths[0][0]] * 2, rel=0.05)

    def test_doors_are_those_of_the_scan(self, panel):
        early, late = (
            pixels(map_figure(panel.grid, panel.poses, panel.truth, scan)) for scan in (0, -1)
        )
        assert (early != late).any()

    def test_same_arguments_same_pixels(self, panel):
        one, two = (pixels(map_figure(panel.grid, panel.poses, panel.truth)) for _ in range(2))
        np.testing.assert_array_equal(one, two)

    def test_an_empty_map_is_a_picture_too(self):
        empty = OccupancyGrid(GridSpec(0.05, 0, 0, 0, 0), np.zeros((0, 0)), np.zeros((0, 0), bool))
        assert pixels(map_figure(empty, np.zeros((0, 3)))).size

    def test_has_a_pixel_for_each_cell_of_a_large_building(self):
        seen = np.ones((1200, 1200), bool)
        grid = OccupancyGrid(GridSpec(0.05, 0, 0, 1200, 1200), np.zeros(seen.shape), seen)
        figure = map_figure(grid)
        figure.canvas.draw()
        assert figure.axes[0].get_window_extent().width > 0.95 * 1200


def test_stretches():
    assert stretches(np.array([1, 1, 0, 0, 1, 0, 1, 1], bool)) == [(0, 2), (4, 5), (6, 8)]
    assert stretches(np.zeros(3, bool)) == stretches(np.zeros(0, bool)) == []


class TestMapPanel:
    def test_occupied_is_dark_free_white_unknown_bluish(self):
        observed = np.array([[True, True, False]])
        dark, white, unknown = shades(toy_grid(np.array([[1.0, 0.0, 0.2]]), observed))[0].tolist()
        assert (dark, white) == ([0, 0, 0], [255, 255, 255])
        assert unknown[0] < unknown[2] < 255

    def test_a_stray_beam_does_not_widen_the_picture(self):
        observed = np.zeros((100, 100), bool)
        observed[30:70, 30:70] = True
        observed[50, :] = True
        expected = 3.05 - MARGIN, 6.95 + MARGIN, 3.05 - MARGIN, 6.95 + MARGIN
        assert MapPanel("", toy_grid(np.zeros((100, 100)), observed)).box == pytest.approx(expected)

    def test_a_box_grows_to_an_aspect_and_no_more(self):
        assert Box(0, 4, 0, 1).shaped(1.0) == Box(0, 4, -1.5, 2.5)
        assert Box(0, 1, 0, 4).shaped(1.0) == Box(-1.5, 2.5, 0, 4)


def test_overview_has_a_panel_a_map_all_of_one_shape(panel, moving):
    lost = run(slam.make("odometry", true_start(moving)), moving)
    panels = [
        MapPanel("Figure 4", lost.grid, lost.poses, moving.truth),
        *(panel._replace(title=f"Figure {n}") for n in (5, 6, 7)),
    ]
    figure = overview_figure(panels)
    assert [axes.get_title() for axes in figure.axes] == [f"Figure {n}" for n in (4, 5, 6, 7)]
    shapes = [np.ptp(axes.get_ylim()) / np.ptp(axes.get_xlim()) for axes in figure.axes]
    assert shapes == pytest.approx([shapes[0]] * 4)


class TestDoorHistogram:
    def test_bars_are_the_counts_of_a_cell_that_a_door_sweeps(self, moving):
        remembered = mapped("dynamic-ml", moving).map_model
        assert isinstance(remembered, Histogram)
        spec = remembered.cells.tiles.spec
        truth = TrueOccupancy(moving.truth, spec.resolution)
        row, col = door_cell(remembered, truth)
        place = truth.spec.cells(spec.centres(np.array([[row, col]])))[0]
        assert 0 < truth.share[tuple(place)] < 1
        bars, there = door_histogram_figure(moving).axes
        heights = [bar.get_height() for bar in bars.patches]
        assert heights == remembered.histogram(row, col).tolist()
        x, y = spec.centres(np.array([[row, col]]))[0]
        assert (np.mean(there.get_xlim()), np.mean(there.get_ylim())) == pytest.approx((x, y))

    def test_no_door_that_moved(self, static):
        with pytest.raises(InputError, match="a door moved"):
            door_histogram_figure(static)

    def test_needs_a_histogram(self, moving):
        with pytest.raises(InputError, match="'static-ml' has none"):
            door_histogram_figure(moving, dynamic="static-ml")
        with pytest.raises(InputError, match="'odometry' is none"):
            door_histogram_figure(moving, dynamic="odometry")

    def test_needs_the_truth(self, moving):
        with pytest.raises(InputError, match="without"):
            door_histogram_figure(Episode(moving.scans, moving.odometry))


class TestLikelihood:
    def test_three_reliefs_above_three_plans(self, static, moving):
        figure = likelihood_figure(static, moving)
        assert [axes.name for axes in figure.axes] == ["3d", "rectilinear"] * 3
        assert figure.axes[0].get_title() == "Figure 2: static map, static doors"
        assert figure.axes[1].get_xlim() == pytest.approx((-RANGE, RANGE), abs=0.02)

    def test_surface_is_the_likelihood(self, static):
        slam_, scan, pose = mapped("static-ml/beta1", static, until=50), static.scans[50], (4, 0, 1)
        around = surface(slam_, scan, Pose2(*pose))
        x, y = 4 + around.offsets[7], around.offsets[30]
        expected = slam_.sensor_model.log_likelihood(scan, np.array([[x, y, 1.0]]))[0]
        assert around.values[30, 7] == pytest.approx(np.exp(expected / len(scan.points)))

    def test_moved_doors_are_less_likely_at_the_true_pose(self, static, moving):
        moment = surprise(moving)
        at_truth = []
        for episode in (static, moving):
            slam_ = mapped("static-ml/beta1", episode, until=moment)
            pose = Pose2.of(episode.truth.poses[moment])
            around = surface(slam_, episode.scans[moment], pose)
            at_truth.append(around.values[len(around.offsets) // 2, len(around.offsets) // 2])
        assert at_truth[1] < at_truth[0]

    def test_peaks_the_highest_first_and_no_foothills(self):
        offsets = np.linspace(-RANGE, RANGE, 81)
        x, y = np.meshgrid(offsets, offsets)

        def hill(height, x0, y0):
            return height * np.exp(-((x - x0) ** 2 + (y - y0) ** 2) / (2 * 0.05**2))

        ground = hill(0.8, 0.0, 0.1) + hill(1.0, 0.3, 0.0) + hill(0.5, -0.3, -0.2)
        np.testing.assert_allclose(
            LikelihoodSurface(offsets, ground).peaks, [(0.3, 0.0), (0.0, 0.1)], atol=1e-9
        )


class TestReplay:
    def test_snapshots_are_of_their_time(self, runs):
        for snapshots in runs.values():
            assert [snapshot.scan for snapshot in snapshots] == [0, 20, 40, SCANS - 1]
            assert [len(snapshot.poses) for snapshot in snapshots] == [1, 21, 41, SCANS]
            seen = [int(snapshot.grid.observed.sum()) for snapshot in snapshots]
            assert seen == sorted(set(seen))

    def test_snapshots_are_not_shared(self, moving):
        first, *_, last = take_snapshots(slam.make("odometry", true_start(moving)), moving, 20)
        assert not np.shares_memory(first.grid.occupied, last.grid.occupied)

    def test_a_frame_a_snapshot_each_with_something_new(self, runs, moving, tmp_path):
        write_replay(tmp_path / "replay.gif", moving, runs, width=400)
        with Image.open(tmp_path / "replay.gif") as gif:
            frames = [np.asarray(frame.convert("RGB")) for frame in ImageSequence.Iterator(gif)]
        assert len(frames) == 4
        assert frames[0].shape[1] == 400
        for before, after in pairwise(frames):
            for panel_before, panel_after in zip(
                np.array_split(before, 3), np.array_split(after, 3), strict=True
            ):
                assert (panel_before != panel_after).any()

    def test_a_lost_robot_is_seen_in_its_panel_while_it_is_lost(self, runs, moving, tmp_path):
        told = [shot._replace(lost=np.full(shot.scan + 1, 0.9)) for shot in runs["static-ml"]]
        told[-1].lost[-1] = 0.1
        sure = [shot._replace(lost=np.full(shot.scan + 1, 0.5)) for shot in runs["dynamic-ml"]]
        write_replay(tmp_path / "replay.gif", moving, {"a": told, "b": sure}, width=400)
        with Image.open(tmp_path / "replay.gif") as gif:
            frames = [np.asarray(frame.convert("RGB")) for frame in ImageSequence.Iterator(gif)]
        found = [
            [int((part == ImageColor.getrgb(LOST)).all(axis=2).sum()) for part in panels]
            for panels in (np.array_split(frame, 3, axis=1) for frame in frames)
        ]
        assert all(a > 1000 for _, a, _ in found[:-1])  # the label and the robot
        assert 0 < found[-1][1] < 1000  # the path
        assert all(truth == b == 0 for truth, _, b in found)

    def test_same_runs_same_bytes(self, runs, moving, tmp_path):
        for name in ("one.gif", "two.gif"):
            write_replay(tmp_path / name, moving, runs, width=300)
        assert (tmp_path / "one.gif").read_bytes() == (tmp_path / "two.gif").read_bytes()

    def test_runs_at_different_scans(self, runs, moving, tmp_path):
        uneven = {"one": runs["static-ml"], "two": runs["dynamic-ml"][1:]}
        with pytest.raises(InputError, match="same scans"):
            write_replay(tmp_path / "replay.gif", moving, uneven)
        with pytest.raises(InputError, match="at least one"):
            write_replay(tmp_path / "replay.gif", moving, {})
        assert not list(tmp_path.iterdir())

    def test_every_scan_at_least(self, moving):
        with pytest.raises(InputError, match="every=0"):
            take_snapshots(slam.make("odometry"), moving, every=0)
