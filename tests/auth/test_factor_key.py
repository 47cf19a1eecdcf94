"""The key of the second factors: encryption, binding to the account, and storage of the key file."""

from base64 import urlsafe_b64encode
from pathlib import Path
from uuid import uuid4

import pytest

from kata.auth.factor_key import FactorKey, FactorKeyError, add_keys, read_factor_key

SECRET = "JBSWY3DPEHPK3PXPJBSWY3DPEHPK3PXP"


def line(byte: int) -> str:
    return urlsafe_b64encode(bytes([byte]) * 32).decode()


def test_sealed_secret_opens_only_with_its_key_and_account() -> None:
    key, account = FactorKey(bytes(32)), uuid4()
    sealed = key.encrypt(SECRET, account)
    assert SECRET not in sealed
    assert len(sealed) <= 160, "it fits its column"
    assert key.encrypt(SECRET, account) != sealed, "the same secret looks different each time"
    assert key.decrypt(sealed, account) == SECRET
    assert key.decrypt(sealed, uuid4()) is None, "put into another's row"
    assert FactorKey(bytes([1]) * 32).decrypt(sealed, account) is None
    for place in (0, 20, len(sealed) - 5):
        changed = sealed[:place] + ("A" if sealed[place] != "A" else "B") + sealed[place + 1 :]
        assert key.decrypt(changed, account) is None
    for nonsense in ("", "x", "not sealed at all", SECRET):
        assert key.decrypt(nonsense, account) is None


def test_factor_key_is_made_once_and_only_for_its_user(tmp_path: Path) -> None:
    file, account = tmp_path / "keys" / "second-factor-key.txt", uuid4()
    sealed = read_factor_key(file).encrypt(SECRET, account)
    assert file.stat().st_mode & 0o777 == 0o600
    assert read_factor_key(file).decrypt(sealed, account) == SECRET, "a second start takes the same one"
    assert [path.name for path in file.parent.iterdir()] == [file.name]


def test_replaced_key_still_opens_from_its_line_below(tmp_path: Path) -> None:
    file, account = tmp_path / "key.txt", uuid4()
    old = read_factor_key(file).encrypt(SECRET, account)
    file.write_text(f"# newer\n{line(7)}\n{file.read_text()}")
    both = read_factor_key(file)
    assert both.decrypt(old, account) == SECRET
    assert FactorKey(bytes([7]) * 32).decrypt(both.encrypt(SECRET, account), account) == SECRET, "the first line seals"


def test_readable_or_malformed_factor_key_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "key.txt"
    read_factor_key(file)
    file.chmod(0o644)
    with pytest.raises(FactorKeyError, match=f"chmod 600 {file}"):
        read_factor_key(file)
    file.chmod(0o600)
    for nothing in ("", "# a remark\n", "c2hvcnQ=\n", f"{line(1)}\nc2hvcnQ=\n", "\N{SNOWMAN}\n"):
        file.write_text(nothing)
        with pytest.raises(FactorKeyError, match="must be reset"):
            read_factor_key(file)
    with pytest.raises(FactorKeyError, match="cannot be used: Not a directory"):
        read_factor_key(file / "key.txt")


def test_key_restored_from_a_backup_is_opened_as_well(tmp_path: Path) -> None:
    here, backed_up, account = tmp_path / "here.txt", tmp_path / "backed-up.txt", uuid4()
    before, then = read_factor_key(here).encrypt(SECRET, account), read_factor_key(backed_up).encrypt(SECRET, account)
    for _ in range(2):
        add_keys(here, backed_up)
    key = read_factor_key(here)
    assert key.decrypt(before, account) == key.decrypt(then, account) == SECRET
    assert len([row for row in here.read_text().splitlines() if not row.startswith("#")]) == 2
    add_keys(tmp_path / "new.txt", backed_up)
    assert read_factor_key(tmp_path / "new.txt").decrypt(then, account) == SECRET
    for file in (here, tmp_path / "new.txt"):
        assert file.stat().st_mode & 0o777 == 0o600
