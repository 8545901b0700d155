"""The driver in C++ reads what dynslam writes, with a SLAM of a few lines in the place of a real
one."""

import math
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from slam.episode import Episode
from slam.geometry import Pose2
from slam.io.csv_log import write_csv
from slam.io.tum import read_tum
from slam.scan import Scan
from slam.trajectory import Trajectory
from tests.docs.pages import ROOT

COMPILER = shutil.which("c++") or shutil.which("g++")
STAND_IN = """
#include "driver.h"
struct Reckoning {  // x, y and theta of the odometry, y + the sum of the echoes
    driver::Laser laser;
    explicit Reckoning(const driver::Laser& given) : laser(given) {
        const auto& [x, y, theta] = laser.mount;
        for (double v : {laser.angle_min, laser.angle_increment, laser.range_min, laser.range_max,
                         x, y, theta})
            std::cout << v << '\\n';
    }
    driver::Pose update(const driver::Reading& reading) {
        driver::Pose pose = reading.odometry;
        for (double range : reading.ranges)
            if (range > laser.range_min && range < laser.range_max) pose.y += range;
        return pose;
    }
};
int main(int count, char** words) { return driver::run<Reckoning>(count, words); }
"""


@pytest.fixture(scope="module")
def program(tmp_path_factory) -> Path:
    if COMPILER is None:
        pytest.skip("no compiler of C++ is here")
    folder = tmp_path_factory.mktemp("cpp")
    (folder / "main.cpp").write_text(STAND_IN)
    include = ROOT / "docs" / "examples" / "cpp"
    subprocess.run(
        [COMPILER, "-std=c++17", "-Wall", "-Wextra", "-Werror", "-O0", "-I", include, "main.cpp",
         "-o", "program"], cwd=folder, check=True,
    )  # fmt: skip
    return folder / "program"


def recording() -> Episode:
    angles = np.linspace(-1.5, 1.5, 5)
    ranges = np.array([1.25, math.inf, math.nan, 0.05, 2.5])  # 3.75 m of echoes
    mount = Pose2(0.1, -0.2, 0.3)
    scan = Scan(ranges, angles, 30.0, 0.1, mount=mount)
    times = np.array([1000.1, 1000.2, 1000.4])
    poses = np.array([[0.0, 0.0, 0.0], [0.1, -0.5, 1.0], [0.25, 1.0, -3.0]])
    scans = tuple(replace(scan, time=time) for time in times)
    return Episode(scans, Trajectory(times, poses))


def test_it_reads_the_recording_and_writes_a_trajectory(program, tmp_path):
    episode = recording()
    write_csv(episode, tmp_path / "log.csv")
    out = tmp_path / "poses.tum"
    done = subprocess.run(
        [program, tmp_path / "log.csv", out], check=True, capture_output=True, text=True
    )
    assert [float(line) for line in done.stdout.split()] == pytest.approx(
        [-1.5, 0.75, 0.1, 30.0, 0.1, -0.2, 0.3], abs=1e-6
    )
    written = read_tum(out)
    assert (written.times == episode.times).all()
    expected = episode.odometry.poses + (0.0, 3.75, 0.0)
    np.testing.assert_allclose(written.poses, expected, atol=1e-5)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("# angle_min: 0\ntime,x,y,theta,r0\n", "no angle_increment"),
        ("# angle_min: 0\ntime,x,y,theta,r0\n1,2,3,4,far\n", "no number: far"),
        ("# angle_min: 0\ntime,x,y,theta,r0\n1,2,3\n", "a row without a scan"),
        (None, "log.csv: cannot be read"),
    ],
)
def test_a_table_that_it_cannot_use_is_told_in_a_line(program, tmp_path, text, told):
    log = tmp_path / "log.csv"
    if text is not None:
        log.write_text(text)
    done = subprocess.run([program, log, tmp_path / "out"], capture_output=True, text=True)
    assert done.returncode == 1
    assert done.stderr.count("\n") == 1
    assert told in done.stderr
