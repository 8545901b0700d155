# pyright: reportMissingImports=false
import base64

import numpy as np
from dynslam_cli.map_page import drive as module
from dynslam_cli.map_page.drive import METRE, drive

from slam.episode import Episode


def read(text: str, kind: str) -> np.ndarray:
    return np.frombuffer(base64.b64decode(text), kind)


def test_numbers_are_those_of_the_run(short_episode: Episode, monkeypatch) -> None:
    monkeypatch.setattr(module, "MAX_POSES", 40)
    monkeypatch.setattr(module, "MAX_MOMENTS", 10)
    n = len(short_episode.scans)
    poses = np.column_stack([np.arange(n), -np.arange(n), np.full(n, 0.5)]).astype(float)
    lost = np.linspace(0.0, 1.0, n)
    told = drive(short_episode, poses, lost)
    shown = read(told["poses"], "<f4").reshape(-1, 3)
    assert len(shown) == 40
    kept = shown[:, 0].round().astype(int)
    assert (kept[0], kept[-1]) == (0, n - 1)
    np.testing.assert_array_equal(read(told["lost"], "u1"), np.rint(100 * lost[kept]))
    since = short_episode.times[kept] - short_episode.times[0]
    np.testing.assert_allclose(read(told["times"], "<f4"), since, atol=1e-4)
    moments, counts = read(told["moments"], "<u4"), read(told["counts"], "<u2")
    echoes = read(told["echoes"], "<i2").reshape(-1, 2) / METRE
    assert len(moments) == len(counts) == 10
    assert (moments[0], moments[-1]) == (0, 39)
    assert len(echoes) == counts.sum()
    assert 10 < counts.max() <= module.MAX_ECHOES
    last = echoes[len(echoes) - int(counts[-1]) :]
    away = np.linalg.norm(last[:, None] - short_episode.scans[-1].points, axis=2).min(axis=1)
    assert away.max() < 1 / METRE
