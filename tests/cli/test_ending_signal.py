"""A signal that ends a loop: it asks, unless the loop is stuck."""

import signal

import pytest

from undertow.cli import interruptible
from undertow.cli.interruptible import EndingSignal


def test_it_asks_and_remembers_the_first(capfd):
    stop, before = EndingSignal(), signal.getsignal(signal.SIGTERM)
    with stop.listening():
        assert not stop.asked()
        signal.raise_signal(signal.SIGTERM)
        signal.raise_signal(signal.SIGINT)
    assert stop.asked() and stop.number == signal.SIGTERM
    assert capfd.readouterr().err == "\nInterrupted: stopping.\n"
    assert signal.getsignal(signal.SIGTERM) is before


def test_a_loop_that_is_stuck_is_interrupted(monkeypatch):
    """As where it prints a line into a full pipe."""
    stop, now = EndingSignal(), [100.0]
    monkeypatch.setattr(interruptible.time, "monotonic", lambda: now[0])
    with stop.listening():
        stop.asked()
        now[0] += 5.1
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
    assert stop.number == signal.SIGINT
