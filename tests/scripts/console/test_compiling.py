# pyright: reportMissingImports=false
import numpy as np
from dynslam_cli.console.compiling import NOTE, compiling_told
from numba import njit


def test_compiling_is_told_once_and_running_is_not(capsys) -> None:
    @njit
    def twice(x):
        return 2 * x

    with compiling_told():
        assert capsys.readouterr().err == ""
        twice(1)
        twice(1.5)
        assert capsys.readouterr().err == f"{NOTE}\n"
        twice(3)
    with compiling_told():
        twice(4)
    assert capsys.readouterr().err == ""
    twice(np.zeros(3))  # compiles, and no one listens any more
    assert capsys.readouterr().err == ""
