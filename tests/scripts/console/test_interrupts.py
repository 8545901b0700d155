# pyright: reportMissingImports=false
"""Ctrl-C waits for the end of a step."""

import os
import signal
import threading

import pytest
from dynslam_cli.console.interrupts import deferred_interrupt


def press() -> None:
    os.kill(os.getpid(), signal.SIGINT)


def test_an_interrupt_waits_for_the_end_of_the_step():
    done = []

    def work() -> None:
        with deferred_interrupt() as between_steps:
            for step in range(3):
                if step == 1:
                    press()
                done.append(step)
                between_steps()

    with pytest.raises(KeyboardInterrupt):
        work()
    assert done == [0, 1]


def test_who_presses_twice_does_not_wait():
    def work() -> None:
        with deferred_interrupt():
            press()
            press()
            pytest.fail("it waited")

    with pytest.raises(KeyboardInterrupt):
        work()


def test_afterwards_all_is_as_before():
    before = signal.getsignal(signal.SIGINT)
    with deferred_interrupt() as between_steps:
        between_steps()
    assert signal.getsignal(signal.SIGINT) is before


def test_in_another_thread_nothing_is_changed():
    found = []

    def work() -> None:
        with deferred_interrupt() as between_steps:
            between_steps()
            found.append(signal.getsignal(signal.SIGINT))

    before = signal.getsignal(signal.SIGINT)
    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert found == [before]
