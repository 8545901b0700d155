"""slam runs on a robot: without the simulator, the pictures and the command line."""

import subprocess
import sys
from pathlib import Path

from slam.io.episode_file import save_episode
from tests.slam.worlds import drive

ALONE = """
import sys

ABSENT = {"gymnasium", "pymunk", "pygame", "matplotlib", "rich", "tyro"}

class Absent:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in ABSENT:
            raise ImportError(f"{name} is absent here")

sys.meta_path.insert(0, Absent())

import importlib, pkgutil
import slam
for module in pkgutil.walk_packages(slam.__path__, "slam."):
    importlib.import_module(module.name)

from slam.benchmark.run import run, true_start
episode = slam.load_episode(sys.argv[1])
done = run(slam.make("static-ml", true_start(episode)), episode)
assert not ABSENT & {name.split(".")[0] for name in sys.modules}, "imported before"
modules = sorted(name for name in sys.modules if name.startswith("slam."))
print(len(modules), len(done.poses), done.matched, abs(done.poses - episode.truth.poses).max())
"""


def test_slam_runs_with_the_simulator_absent(tmp_path: Path) -> None:
    save_episode(drive(20), tmp_path / "drive.npz")
    root = Path(__file__).parents[2]
    command = [sys.executable, "-c", ALONE, str(tmp_path / "drive.npz")]
    done = subprocess.run(command, cwd=root, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    modules, poses, matched, error = done.stdout.split()
    files = [path for path in (root / "slam").rglob("*.py") if path != root / "slam/__init__.py"]
    assert int(modules) == len(files)
    assert int(poses) == 20
    assert int(matched) > 5
    assert float(error) < 0.1
