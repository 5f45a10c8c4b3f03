"""What the tests of the command line share."""

from __future__ import annotations

import pytest


@pytest.fixture
def run(package, capfd):
    """Run the command in this process: exit status, standard output, standard error."""

    def command(*arguments):
        capfd.readouterr()
        status = package("cli").main([str(a) for a in arguments])
        return status, *capfd.readouterr()

    return command
