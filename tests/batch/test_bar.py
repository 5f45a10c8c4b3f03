"""How far a batch is: counted right, told on a terminal, and nowhere else."""

from __future__ import annotations

import builtins
import io
import sys

import pytest

from omt_uv.batch.bar import BASE_SIZE, Progressed, shown, work_of


class Terminal(io.StringIO):
    def isatty(self):
        return True


def test_the_time_left_goes_by_the_work_and_the_rate_by_files():
    now = [100.0]
    state = Progressed(4, 100.0, lambda: now[0])
    assert state.seconds_left() == 0.0
    now[0] += 30
    state.add(25.0, False), state.add(15.0, True)
    assert (state.done, state.failed, state.part) == (2, 1, 40.0)
    assert state.seconds_left() == pytest.approx(45.0)
    assert state.text() == "2 of 4, 1 failed, 4.0 a minute" and state.left_text() == "0:00:45 left"
    now[0] += 30 * 133
    assert state.left_text() == "1:40:30 left"
    assert work_of(50) - work_of(0) == 50 and work_of(0) == BASE_SIZE


@pytest.mark.parametrize("rich", [True, False])
@pytest.mark.parametrize("count", [0, 3])
@pytest.mark.parametrize("stream", [io.StringIO, Terminal])
def test_it_is_drawn_on_terminals_alone(monkeypatch, stream, count, rich):
    def missing(name, *rest):
        if name.startswith("rich") and not rich:
            raise ModuleNotFoundError(name)
        return real(name, *rest)

    real, err = builtins.__import__, stream()
    monkeypatch.setattr(sys, "stderr", err)
    monkeypatch.setattr(builtins, "__import__", missing)
    with shown(count, 10.0) as step:
        step(4.0, False)
        step(6.0, True)
    assert bool(err.getvalue()) == (stream is Terminal and count > 0)
    if err.getvalue() and not rich:
        assert "2 of 3, 1 failed" in err.getvalue() and err.getvalue().endswith("\r\033[K")
