"""A full disk leaves the station's file as it was. A cut file is a valid file: every missing value has its default."""

import resource
from pathlib import Path

import pytest
from msgspec import structs

from kata.device import config
from kata.device.config import StationConfig


def test_full_disk_leaves_the_file_unchanged(tmp_path: Path) -> None:
    station = structs.replace(StationConfig(), side="left", name="A station with a long name " * 3)
    file = tmp_path / "station.toml"
    config.write(station, file)
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (50, limits[1]))
    try:
        with pytest.raises(OSError, match="File too large"):
            config.write(structs.replace(station, side="right"), file)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert config.read(file) == station
    assert list(tmp_path.iterdir()) == [file]


def test_new_content_keeps_mode_of_the_file(tmp_path: Path) -> None:
    """The service reads as another user what a technician has written."""
    file = tmp_path / "station.toml"
    config.write(StationConfig(), file)
    file.chmod(0o640)
    config.write(structs.replace(StationConfig(), side="left"), file)
    assert file.stat().st_mode & 0o777 == 0o640
    assert config.read(file).side == "left"
