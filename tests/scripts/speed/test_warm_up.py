# pyright: reportMissingImports=false
"""`dynslam warm-up`: what it compiles is what a bench needs."""

import subprocess
import sys

from dynslam_cli import main
from dynslam_cli.trials.warm_up import SCANS, Room

from slam.benchmark.run import build, run

# In a process of its own: kernels that other tests compiled would count as compiled by the jobs.
WHAT_IS_NEW = """
import gc
from numba.core.registry import CPUDispatcher
from dynslam_cli.bench.suites import paper
from dynslam_cli.trials.warm_up import warm_up_jobs

def compiled():
    return {
        (one.__module__, one.__name__, str(signature))
        for one in gc.get_objects() if type(one) is CPUDispatcher
        for signature in one.signatures
    }

VARIANTS = ["static-ml", "hmm-ml", "static-ml/beta1", "dynamic-graph"]
for job in warm_up_jobs(["DoorCorridor-v0"], VARIANTS):
    assert not job().row.get("error")
gc.unfreeze()
before = compiled()
assert len(before) > 40, len(before)
for trial in paper().trials(VARIANTS, range(1), 600.0)[len(VARIANTS):]:
    assert not trial().row["error"]
gc.unfreeze()
for one in sorted(compiled() - before):
    print(*one)
"""


def test_a_bench_after_it_compiles_hardly_anything():
    done = subprocess.run([sys.executable, "-c", WHAT_IS_NEW], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    ours = [line for line in done.stdout.splitlines() if not line.startswith("numba.")]
    assert len(ours) <= 4, done.stdout


def test_the_room_is_one_that_a_slam_can_map():
    episode = Room().make()
    done = run(build("static-ml", episode), episode)
    assert done.matched == SCANS - 1
    assert abs((done.poses - episode.odometry.poses)[:, :2]).max() < 0.05


def test_the_command(capsys):
    assert main.status(["warm-up", "--variants", "odometry,static-ml", "--jobs", "1"]) == 0
    assert capsys.readouterr().out.startswith("6 worlds, 9 jobs, ")
    assert main.status(["warm-up", "--variants", "statik-ml"]) == 2
    assert "did you mean static-ml" in capsys.readouterr().err
