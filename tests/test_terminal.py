"""The output of the command on a terminal."""

import pytest

from kata.system.console import fail


@pytest.mark.parametrize("place", ["/clinic/[old]/kata.db", "/clinic/[/old]/kata.db"])
def test_console_error_is_printed_exactly_whatever_it_contains(place: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        fail(f"{place} already contains a database; " + "the demonstration needs a new folder. " * 4)
    assert ended.value.code == 1
    said = capsys.readouterr().err
    assert said.startswith(f"{place} already contains a database; ")
    assert said.count("\n") == 1
