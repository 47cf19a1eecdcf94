"""What the command says on the terminal."""

import pytest

from kata.console import fail


@pytest.mark.parametrize("place", ["/clinic/[old]/kata.db", "/clinic/[/old]/kata.db"])
def test_what_is_wrong_is_said_as_it_is_whatever_stands_in_it(place: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        fail(f"{place} holds a database already; " + "the demonstration wants a fresh one. " * 4)
    assert ended.value.code == 1
    said = capsys.readouterr().err
    assert said.startswith(f"{place} holds a database already; ")
    assert said.count("\n") == 1
