"""Write the report: report.html, results.csv, figures/ as PNG and SVG, tables/ for a paper."""

from __future__ import annotations

import base64
import csv
import io
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.figure import Figure

from slam.benchmark.results import Result
from slam.errors import InputError
from slam.io.files import replacing

from ..console.html_page import filled_in, json_for_script
from ..console.output import write_png
from ..trials.recorded_run import RecordedRun, load
from ..trials.results import Condition
from .charts import Chart, charts, shown
from .lost import lost_table, reliability_chart
from .maps import maps
from .phase import phase_diagrams
from .replay import replay
from .summary import BENCH_WORDING, Summary, Wording
from .tables import Table, latex, markdown, tables

HERE = Path(__file__).parent
NO_MATH: dict[Any, Any] = {"text.parse_math": False}  # names may contain dollars
REPRODUCIBLE: dict[Any, Any] = {"svg.hashsalt": "dynslam", "svg.fonttype": "path"}


def write_report(
    rows: Sequence[Result], out: Path, order: Sequence[str] = (), wording: Wording = BENCH_WORDING
) -> Iterator[Path]:
    """Write everything that the results allow into `out`; yields each path when it is written.

    order    of the variants; the others are compared with the first
    wording  of the page
    """
    with mpl.rc_context(NO_MATH):
        yield from _write(Summary(rows, order, wording), out)


def _write(summary: Summary, out: Path) -> Iterator[Path]:
    yield _written(out / "results.csv", _csv(summary.rows))
    lost = lost_table(summary)
    made = [*tables(summary), *([lost] if lost.rows else [])]
    for table in made:
        yield _written(out / "tables" / f"{table.name}.md", markdown(table))
        yield _written(out / "tables" / f"{table.name}.tex", latex(table))
    drawn: list[tuple[Chart, str]] = []
    replays = []
    for chart in (*charts(summary), *phase_diagrams(summary), *_reliability(summary)):
        drawn.append((chart, _figure(chart, out / "figures")))
        yield out / "figures" / f"{chart.name}.png"
    for number, condition in enumerate(shown(summary), 1):
        seed, runs = _recorded_runs(summary, condition, out / "examples")
        if runs:
            chart = maps(condition, runs, number)
            drawn.append((chart, _figure(chart, out / "figures")))
            replays.append(replay(condition, runs, seed))
            yield out / "figures" / f"{chart.name}.png"
    yield _written(out / "report.html", page(summary, made, drawn, replays))


def _reliability(summary: Summary) -> Iterator[Chart]:
    chart = reliability_chart(summary)
    if chart is not None:
        yield chart


def page(
    summary: Summary,
    made: Sequence[Table],
    drawn: Sequence[tuple[Chart, str]],
    replays: Sequence[dict[str, Any]],
) -> str:
    """The page: one file without network requests."""
    return filled_in(
        HERE,
        summary=summary,
        title=_title(summary),
        failed=sum(row.get("error") is not None for row in summary.rows),
        episodes=len({row["episode"] for row in summary.rows}),
        origins=_origins(summary.rows),
        tables=made,
        drawn=drawn,
        replays=json_for_script(replays),
        js=(HERE / "page.js").read_text(encoding="utf-8"),
    )


def _title(summary: Summary) -> str:
    command = summary.wording.command
    suites = dict.fromkeys(row["suite"] for row in summary.rows if row["suite"] != command)
    return f"dynslam {command}: {', '.join(suites)}" if suites else f"dynslam {command}"


def _origins(rows: Sequence[Result]) -> list[str]:
    """Commits, versions and machines, each once."""
    origins = (
        f"commit {row['commit'] or 'unknown'}, "
        f"{', '.join(f'{name} {number}' for name, number in row['versions'].items())}; "
        f"{row['host'].get('machine')}, {row['host'].get('cores')} cores"
        for row in rows
    )
    return list(dict.fromkeys(origins))


def _recorded_runs(
    summary: Summary, condition: Condition, folder: Path
) -> tuple[int, dict[str, RecordedRun]]:
    """The first seed, and its recorded runs by variant."""
    found: dict[str, RecordedRun] = {}
    seed = min(row["seed"] for group in summary.of(condition) for row in group.rows)
    for group in summary.of(condition):
        row = next((row for row in group.rows if row["seed"] == seed), None)
        path = folder / f"{row['run']}.npz" if row else folder
        if path.is_file():
            try:
                found[group.variant] = load(path)
            except InputError as error:  # damaged: the page does without it
                print(f"warning: {error}; left out", file=sys.stderr)
    return seed, found


def _figure(chart: Chart, folder: Path) -> str:
    """Write a chart as PNG and SVG; returns the SVG as a data URL."""
    folder.mkdir(exist_ok=True)
    write_png(chart.figure, folder / f"{chart.name}.png")
    chart.figure.set_layout_engine("none")  # both have the layout that was found for the PNG
    svg = _svg(chart.figure)
    with replacing(folder / f"{chart.name}.svg") as file:
        file.write(svg)
    return "data:image/svg+xml;base64," + base64.b64encode(svg).decode()


def _svg(figure: Figure) -> bytes:
    file = io.BytesIO()
    with mpl.rc_context(REPRODUCIBLE):
        figure.savefig(file, format="svg", metadata={"Date": None})
    return file.getvalue()


def _csv(rows: Sequence[Result]) -> str:
    """All scalar values, one line per run."""
    flat = [{k: v for k, v in row.items() if not isinstance(v, dict | list)} for row in rows]
    file = io.StringIO()
    names = list(dict.fromkeys(name for row in flat for name in row))
    writer = csv.DictWriter(file, names, lineterminator="\n")
    writer.writeheader()
    writer.writerows(flat)
    return file.getvalue()


def _written(path: Path, text: str) -> Path:
    path.parent.mkdir(exist_ok=True)
    with replacing(path) as file:
        file.write(text.encode())
    return path
