"""The work of `dynslam warm-up`."""

from __future__ import annotations

import sys
import time
from typing import TYPE_CHECKING

from dynslam_env import WORLDS

from ..console.progress import progress_bar
from ..console.selection import parse_variants
from ..trials.pool import check_workers, here
from ..trials.warm_up import warm_up_jobs

if TYPE_CHECKING:
    from .warm_up import WarmUpCommand


def compile_kernels(options: WarmUpCommand) -> int:
    """Run the jobs that compile; the exit status."""
    check_workers(options.jobs)
    jobs = warm_up_jobs(list(WORLDS), parse_variants(options.variants))
    begun, errors = time.monotonic(), []
    with progress_bar() as bar:
        done = here(jobs, options.jobs)
        for one in bar.track(done, len(jobs), description="compiling kernels"):
            if one.row.get("error"):
                errors.append(f"{one.row['variant']}: {one.row['error']}")
    for error in errors:
        print(f"failed: {error}", file=sys.stderr)
    print(f"{len(WORLDS)} worlds, {len(jobs)} jobs, {time.monotonic() - begun:.0f} s")
    return int(bool(errors))
