"""Maps a CARMEN log with `slam` alone: `python slam_alone.py LOG`, where numpy, numba and scipy are
installed and nothing else. Prints the number of scans, and the error of the last pose in m."""

import sys
from importlib.util import find_spec

from slam.benchmark.run import run
from slam.io.formats import read_log
from slam.registry import make

ABSENT = ("gymnasium", "pymunk", "pygame", "matplotlib", "rich", "tyro", "torch")

if __name__ == "__main__":
    found = [name for name in ABSENT if find_spec(name)]
    if found:
        sys.exit(f"this environment is to hold slam alone, and has {', '.join(found)}")
    episode = read_log(sys.argv[1]).episode
    done = run(make("dynamic-ml"), episode)
    if not done.matched or not done.grid.observed.any():
        sys.exit("no scan was matched, or the map is empty")
    print(f"{len(done.poses)} scans, {done.matched} matched, {done.grid.observed.sum()} cells seen")
