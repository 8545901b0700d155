"""The command `dynslam`: its subcommands; user errors print one line without a traceback."""

from __future__ import annotations

import gc
import io
import os
import sys
import textwrap
from importlib import import_module
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path
from typing import Annotated, Any, NamedTuple, Union

from .console.exits import EXIT_INTERRUPTED, EXIT_MISTAKE, EXIT_PIPE

COLLECTIONS = 200_000, 20, 100  # objects, and rounds, between searches for cycles: Python's own
# 700, 10 and 10 take a tenth of the time of `dynslam map`, and free nothing there


class Subcommand(NamedTuple):
    """A subcommand, which is imported only when it is run.

    module   below `dynslam_cli`
    name     of the dataclass in it: its fields are the options, a call runs the command
    summary  the first sentence of its docstring
    """

    module: str
    name: str
    summary: str

    def load(self) -> type[Any]:
        """The dataclass."""
        return getattr(import_module(f"{__package__}.{self.module}"), self.name)


GROUPS: dict[str, dict[str, Subcommand]] = {
    "Map a recording": {
        "map": Subcommand(
            "mapping.map", "MapCommand",
            "Make a map of a recording without traces of moving doors and people.",
        ),
        "merge": Subcommand(
            "mapping.merge", "MergeCommand",
            "Merge two saved maps of parts of a place that overlap.",
        ),
        "info": Subcommand(
            "recordings.info", "InfoCommand",
            "Tell what is in a recording: topics, lasers, odometry, how long and how far, what is "
            "wrong.",
        ),
        "convert": Subcommand(
            "recordings.convert", "ConvertCommand", "Write a recording in another format."
        ),
        "run": Subcommand(
            "mapping.run", "RunCommand",
            "Run a SLAM variant on a recording and measure its accuracy, time and memory.",
        ),
    },
    "Compare SLAM variants": {
        "demo": Subcommand(
            "demo.demo", "DemoCommand",
            "Run the paper's experiment: paired drives past static and moving doors.",
        ),
        "bench": Subcommand(
            "bench.bench", "BenchCommand",
            "Run SLAM variants on the same episodes and write scores, statistics and a report.",
        ),
        "compare": Subcommand(
            "bench.compare", "CompareCommand",
            "Compare two benches of the same suite, before and after a change of the code.",
        ),
        "record": Subcommand(
            "recordings.record", "RecordCommand",
            "Record simulated drives as files for any SLAM system.",
        ),
        "score": Subcommand(
            "bench.score", "ScoreCommand",
            "Score trajectories, and maps if given, against the truth of recorded episodes.",
        ),
    },
    "Train agents": {
        "train": Subcommand(
            "training.train", "TrainCommand",
            "Train a policy by PPO; the same seed gives the same policy, interrupted or not.",
        ),
        "evaluate": Subcommand(
            "training.evaluate", "EvaluateCommand",
            "Compare agents on the same patrols; write results.jsonl, report.html and films.",
        ),
        "curves": Subcommand(
            "training.curves", "CurvesCommand",
            "Draw the learning curves of several trainings and their interquartile mean.",
        ),
        "play": Subcommand(
            "driving.play", "PlayCommand",
            "Drive a simulated robot by keyboard and watch the map grow.",
        ),
    },
    "Studies of the project": {
        "study": Subcommand(
            "studies.study", "StudyCommand",
            "Run a study that varies one part of the SLAM or of the world at a time.",
        ),
        "ghosts": Subcommand(
            "studies.ghosts", "GhostsCommand",
            "Count ghosts in maps: occupied cells where nothing permanent stands.",
        ),
        "doors": Subcommand(
            "studies.doors", "DoorsCommand",
            "Find doors in maps of simulated drives, and compare them with the true ones.",
        ),
        "belief": Subcommand(
            "studies.belief", "BeliefCommand",
            "Compare two beliefs about doors on the same drives: `DynamicMap` and `BeliefMap`.",
        ),
        "forecast": Subcommand(
            "studies.forecast", "ForecastCommand",
            "Learn a door's habits from its history and score forecasts of later weeks.",
        ),
        "endure": Subcommand(
            "studies.endure", "EndureCommand",
            "Drive at random through all worlds; report NaNs, escapes, memory growth, slow steps.",
        ),
        "speed": Subcommand(
            "speed.speed", "SpeedCommand",
            "Measure processor time and memory of the environment and of SLAM variants.",
        ),
        "warm-up": Subcommand(
            "speed.warm_up", "WarmUpCommand",
            "Compile the kernels of worlds and SLAM variants now, once after an installation.",
        ),
    },
}  # fmt: skip
"""What `dynslam --help` lists, in its order: group -> name -> command."""

COMMANDS = {name: command for group in GROUPS.values() for name, command in group.items()}


def main(arguments: list[str] | None = None) -> None:
    """Run `dynslam ARGUMENTS` and exit with its status."""
    gc.set_threshold(*COLLECTIONS)
    sys.exit(status(arguments))


def status(arguments: list[str] | None = None) -> int:
    """Run `dynslam ARGUMENTS`; 0, 2 after a user error, 130 after Ctrl-C, 141 on a broken pipe."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):  # a name that the terminal has no letters for
            stream.reconfigure(errors="backslashreplace")
    mistake = foreign_packages()
    if mistake:
        print(f"dynslam: {mistake}", file=sys.stderr)
        return EXIT_MISTAKE
    from slam.errors import InputError

    try:
        return _run(sys.argv[1:] if arguments is None else arguments)
    except InputError as error:
        print(f"dynslam: {error}", file=sys.stderr)
    except BrokenPipeError:  # the reader of the output has closed it
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return EXIT_PIPE
    except OSError as error:
        where = f"{error.filename}: " if error.filename else ""
        print(f"dynslam: {where}{error.strerror or error}", file=sys.stderr)
    except MemoryError as error:
        told = f" ({error})" if str(error) else ""  # numpy tells what it asked for
        print(f"dynslam: out of memory{told}", file=sys.stderr)
    except KeyboardInterrupt:
        print("dynslam: interrupted", file=sys.stderr)
        return EXIT_INTERRUPTED
    return EXIT_MISTAKE


def _run(arguments: list[str]) -> int:
    if not arguments:
        print(overview(), file=sys.stderr)
        return EXIT_MISTAKE
    name, *options = arguments
    if name in ("-h", "--help"):
        print(overview())
        sys.exit(0)
    if name == "--version":
        print(f"dynslam {version('dynslam')}")
        return 0
    if name.startswith("--tyro-"):  # shell completion, of all commands
        return _parse(_any_command(), "dynslam", arguments)()
    if name not in COMMANDS:
        from slam.errors import InputError
        from slam.validation import unknown_name

        raise InputError(unknown_name("command", name, COMMANDS, "dynslam --help"))
    from .console.config_file import with_config

    command = COMMANDS[name].load()
    return _parse(command, f"dynslam {name}", with_config(command, options))()


def overview() -> str:
    """What `dynslam --help` prints."""
    lines = ["usage: dynslam COMMAND [OPTIONS]", "", "2D laser SLAM in places that change."]
    width = max(map(len, COMMANDS)) + 4
    for title, commands in GROUPS.items():
        lines += ["", f"{title}:"]
        for name, command in commands.items():
            lines += textwrap.wrap(
                command.summary, 80, initial_indent=f"  {name}".ljust(width),
                subsequent_indent=" " * width,
            )  # fmt: skip
    return "\n".join(
        [
            *lines,
            "",
            "The options of a command: dynslam COMMAND --help",
            "The version: dynslam --version",
        ]
    )


def _parse(kind: Any, program: str, arguments: list[str]) -> Any:
    """The command with its options; exits with status 0 after --help, 2 after a user error."""
    import tyro

    config = (tyro.conf.FlagCreatePairsOff, tyro.conf.OmitSubcommandPrefixes)
    return tyro.cli(kind, prog=program, args=arguments, config=config)


def _any_command() -> Any:
    import tyro

    kinds = (
        Annotated[command.load(), tyro.conf.subcommand(name)] for name, command in COMMANDS.items()
    )
    return Union[tuple(kinds)]  # noqa: UP007  (made at run time)


def foreign_packages() -> str:
    """Message if a foreign package `slam` or `agents` shadows ours, else empty.

    Ours lie beside this folder, in a checkout and in site-packages alike.
    """
    home = Path(__file__).resolve().parent.parent
    for name in ("slam", "dynslam_env", "agents"):
        spec = find_spec(name)
        found = Path(spec.origin or "").resolve().parent if spec else None
        if found != home / name:
            return (
                f"the package `{name}` was found at {found}, which is not dynslam's; "
                f"uninstall the other, or use an environment of its own"
            )
    return ""


if __name__ == "__main__":
    main()
