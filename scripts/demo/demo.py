"""`dynslam demo`: the paper's experiment end to end, with its table, its pictures and a film."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console

from agents import record_corridor
from slam.benchmark.results import Result, append
from slam.errors import InputError
from slam.io.files import replacing

from ..bench.suites import paper
from ..console.exits import EXIT_INTERRUPTED
from ..console.output import output_directory
from ..console.progress import progress_bar
from ..console.selection import parse_variants
from ..trials.pool import here
from .album import write_album
from .comparison import findings
from .table import markdown, terminal

PAPERS = "odometry,static-ml,clamped-ml,dynamic-ml,hmm-ml,static-ml/beta1,dynamic-ml/beta1"
PICTURED = 13  # the seed of the pair in the pictures: in its figure 3 a door misleads static ML


LIMIT = 600.0  # s, for one run


@dataclass
class DemoCommand:
    """The paper's experiment: paired drives past static and moving doors, all variants on each.

    Takes one to two minutes on two cores; the first time longer, while kernels compile.
    Writes results.jsonl, table.md, the paper's figures as PNG, and replay.gif.
    """

    out: Path = Path("out/demo")
    """Directory to write to; results of an earlier demo there are replaced."""
    seeds: int = 30
    """Number of pairs of episodes."""
    jobs: int = 2
    """Number of episodes that are run at the same time; -1 takes all cores."""
    variants: str = PAPERS
    """SLAM variants to compare, with commas between; or all; or plain: those without a slash."""

    def __call__(self) -> int:
        """Run, print, draw."""
        if self.seeds < 1 or self.jobs < -1 or self.jobs == 0:
            raise InputError(
                f"demo needs seeds >= 1 and jobs >= 1 (or -1), "
                f"got seeds={self.seeds} and jobs={self.jobs}"
            )
        variants = parse_variants(self.variants)
        out = output_directory(self.out)
        console = Console()
        collected: list[Result] = []
        try:
            self._measure(variants, out / "results.jsonl", collected)
            interrupted = False
        except KeyboardInterrupt:
            print(
                f"demo: interrupted, {len(collected)} runs are kept; no pictures are drawn",
                file=sys.stderr,
            )
            interrupted = True
        if not collected:
            return EXIT_INTERRUPTED
        collected.sort(
            key=lambda row: (variants.index(row["variant"]), row["seed"], row["doors"] != "static")
        )
        with replacing(out / "table.md") as file:
            file.write(f"{markdown(collected)}\n```\n{findings(collected)}\n```\n".encode())
        console.print(terminal(collected, self._title(collected)))
        console.print(f"\nThe same drives, paired:\n{findings(collected)}\n", highlight=False)
        if not interrupted:
            self._draw(out)
        console.print(f"written to {out}", highlight=False, soft_wrap=True)
        return EXIT_INTERRUPTED if interrupted else 0

    def _measure(self, variants: list[str], path: Path, collected: list[Result]) -> None:
        """All results, appended to `path` as they come."""
        todo = paper().trials(variants, range(self.seeds), LIMIT)
        with progress_bar() as progress:
            runs = progress.track(here(todo, self.jobs), len(todo), description="runs")
            for number, done in enumerate(runs):
                if number == 0:
                    path.unlink(missing_ok=True)
                append(path, done.row)
                collected.append(done.row)

    def _draw(self, out: Path) -> None:
        with progress_bar() as progress:
            static, moving = (record_corridor(PICTURED, doors) for doors in ("static", "moving"))
            pictures = write_album(static, moving, out)
            for _ in progress.track(pictures, total=None, description="drawing"):
                pass

    def _title(self, collected: list[Result]) -> str:
        pairs = len({row["seed"] for row in collected})
        return f"DoorCorridor-v0, {pairs} pairs of drives: medians, 95 % intervals"
