"""`dynslam convert A B`: a recording in another format."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import tyro

from slam.errors import InputError

from ..console.output import output_directory
from .source import RecordingSource


@dataclass(kw_only=True)
class ConvertCommand(RecordingSource):
    """Write a recording in another format.

    The ending of the new name chooses it: .npz keeps everything; .bag is ROS 1, .mcap and .db3 are
    ROS 2, no ending a ROS 2 bag in a folder; .log and .log.gz are CARMEN; .csv is a table with a
    row per scan. What a format cannot represent is left out.
    """

    to: tyro.conf.Positional[Path]
    """File to write; its folder is made."""
    force: bool = False
    """Overwrite an existing file."""

    def __call__(self) -> int:
        """Read, write, print."""
        from slam.io.formats import check_ending, write_log
        from slam.preprocessing.several_lasers import merged

        check_ending(self.to)
        if self.to.exists() and not self.force:
            raise InputError(f"{self.to}: is there already; --force writes over it")
        output_directory(self.to.parent)
        episode = merged([log.episode for log in self.read_lasers()])
        write_log(episode, self.to)
        print(f"{self.to}: {len(episode.scans)} scans")
        return 0
