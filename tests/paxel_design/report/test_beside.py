"""A call in another process: its result, its error, and none where there is one job."""

import os

import pytest

from paxel_design.report.beside import beside
from paxel_runtime.errors import PaxelError, SettingsError
from paxel_runtime.settings import make_settings


def test_a_call_beside_gives_its_result() -> None:
    theirs = beside(os.getpid, jobs=2)
    assert theirs() != os.getpid()
    assert beside(os.getpid, jobs=1)() == os.getpid()


def test_an_error_beside_is_told_when_the_result_is_asked_for() -> None:
    with pytest.raises(PaxelError, match="--preset must be one of"):
        beside(make_settings, "nothing", jobs=2)()
    with pytest.raises(SettingsError, match="--preset must be one of"):
        beside(make_settings, preset="nothing", jobs=1)()
