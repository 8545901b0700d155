"""The command `dynslam`: its subcommands, and one line instead of a traceback for a mistake."""

from __future__ import annotations

import os
import sys
from importlib.util import find_spec
from pathlib import Path
from typing import Annotated

from .console.exits import EXIT_INTERRUPTED, EXIT_MISTAKE, EXIT_PIPE


def main(arguments: list[str] | None = None) -> None:
    """Run `dynslam ARGUMENTS` and leave with its exit status."""
    sys.exit(status(arguments))


def status(arguments: list[str] | None = None) -> int:
    """Run `dynslam ARGUMENTS`; 0, or 2 after a mistake, 130 after Ctrl-C, 141 cut off by a pipe."""
    mistake = foreign_packages()
    if mistake:
        print(f"dynslam: {mistake}", file=sys.stderr)
        return EXIT_MISTAKE
    from slam.errors import InputError

    try:
        return _command(arguments)
    except InputError as error:
        print(f"dynslam: {error}", file=sys.stderr)
    except BrokenPipeError:  # whoever read our output has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return EXIT_PIPE
    except OSError as error:
        where = f"{error.filename}: " if error.filename else ""
        print(f"dynslam: {where}{error.strerror or error}", file=sys.stderr)
    except MemoryError as error:
        print(f"dynslam: out of memory ({error})", file=sys.stderr)
    except KeyboardInterrupt:
        print("dynslam: interrupted", file=sys.stderr)
        return EXIT_INTERRUPTED
    return EXIT_MISTAKE


def _command(arguments: list[str] | None) -> int:
    import tyro

    from .bench import bench as bench
    from .bench import compare, score
    from .demo import demo
    from .driving import play
    from .mapping import map as map_recording
    from .mapping import run
    from .recordings import convert, info, record
    from .speed import speed
    from .studies import endure, ghosts, study
    from .training import curves, train
    from .training import evaluate as evaluate

    known = (
        Annotated[bench.BenchCommand, tyro.conf.subcommand("bench")]
        | Annotated[compare.CompareCommand, tyro.conf.subcommand("compare")]
        | Annotated[convert.ConvertCommand, tyro.conf.subcommand("convert")]
        | Annotated[curves.CurvesCommand, tyro.conf.subcommand("curves")]
        | Annotated[demo.DemoCommand, tyro.conf.subcommand("demo")]
        | Annotated[endure.EndureCommand, tyro.conf.subcommand("endure")]
        | Annotated[evaluate.EvaluateCommand, tyro.conf.subcommand("evaluate")]
        | Annotated[ghosts.GhostsCommand, tyro.conf.subcommand("ghosts")]
        | Annotated[info.InfoCommand, tyro.conf.subcommand("info")]
        | Annotated[map_recording.MapCommand, tyro.conf.subcommand("map")]
        | Annotated[play.PlayCommand, tyro.conf.subcommand("play")]
        | Annotated[record.RecordCommand, tyro.conf.subcommand("record")]
        | Annotated[run.RunCommand, tyro.conf.subcommand("run")]
        | Annotated[score.ScoreCommand, tyro.conf.subcommand("score")]
        | Annotated[speed.SpeedCommand, tyro.conf.subcommand("speed")]
        | Annotated[study.StudyCommand, tyro.conf.subcommand("study")]
        | Annotated[train.TrainCommand, tyro.conf.subcommand("train")]
    )
    config = (tyro.conf.FlagCreatePairsOff, tyro.conf.OmitSubcommandPrefixes)
    description = "2D laser SLAM in places that change."
    command = tyro.cli(
        known, prog="dynslam", description=description, args=arguments, config=config
    )
    return command()


def foreign_packages() -> str:
    """What to say if somebody else's `slam` or `agents` would be imported for ours, else empty.

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
