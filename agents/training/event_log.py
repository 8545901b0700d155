"""TensorBoard's log of a training that may be killed and resumed."""

from __future__ import annotations

from pathlib import Path

from stable_baselines3.common.logger import Logger, TensorBoardOutputFormat
from torch.utils.tensorboard import SummaryWriter

FOLDER = "tensorboard_1"


def event_logger(folder: Path, from_step: int) -> Logger:
    """A logger that writes to `folder`/FOLDER, for a training that goes on: TensorBoard leaves out
    what was logged there at `from_step` or later, before the training was killed."""
    where = str(folder / FOLDER)
    return Logger(where, [ResumedTensorBoard(where, from_step)])


class ResumedTensorBoard(TensorBoardOutputFormat):
    """Of stable-baselines3, but what was logged at `from_step` or later counts no more."""

    def __init__(self, folder: str, from_step: int) -> None:
        self.writer = SummaryWriter(log_dir=folder, purge_step=from_step)
        self._is_closed = False
