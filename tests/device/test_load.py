"""What is checked of a recording before it is loaded, outside the control thread: in each method, and what was learned of it."""

import math
import socket
from collections.abc import Callable, Iterator
from pathlib import Path

import msgspec
import numpy as np
import pytest

from kata.device.config import StationConfig
from kata.device.exchange import Exchange, Taken
from kata.device.messages import Load, Request, frame
from kata.motion.learning import LARGEST_DEG, rows
from kata.motion.linkage import Floats
from kata.motion.trajectory import Held, Trajectory
from tests.device.stepped import REST_DEG

SECONDS = 3.0
TIMES_S = np.arange(0.0, SECONDS + 0.001, 0.01)
Loading = Callable[..., Taken]


def angles(**motors: Floats) -> Floats:
    """At rest, but for the motors that are given."""
    found = np.tile(np.array(REST_DEG), (len(TIMES_S), 1))
    for name, values in motors.items():
        found[:, int(name.removeprefix("motor")) - 1] = values
    return found


def correction(deg: float = 1.0, count: int = rows(SECONDS)) -> bytes:
    return np.full((count, 5), deg, dtype="<f8").tobytes()


def message(angles_deg: Floats | None = None, **changes: object) -> Load:
    there = angles() if angles_deg is None else angles_deg
    load = Load(run_id="r", recording_id="a", times_s=TIMES_S.astype("<f8").tobytes(), angles_deg=there.tobytes())
    return msgspec.structs.replace(load, **changes)


@pytest.fixture
def loading(tmp_path: Path) -> Iterator[Loading]:
    """What comes of a Load at a station."""
    service, device = socket.socketpair()

    def load(command: Load, config: StationConfig | None = None) -> Taken:
        exchange = Exchange(config or StationConfig(), device, tmp_path)
        service.sendall(frame(Request(id=1, command=command)))
        exchange._receive(bytearray())
        taken = exchange.take_command()
        assert taken is not None
        return taken

    with service, device:
        yield load


@pytest.mark.parametrize("method", ["paper", "smooth", "learned"])
def test_each_method_has_its_reference(loading: Loading, method: str) -> None:
    taken = loading(message(method=method))
    assert taken.refusal is None
    assert isinstance(taken.trajectory, Held if method == "paper" else Trajectory)
    assert isinstance(taken.trajectory, Held) == (method == "paper")
    assert taken.correction is None


@pytest.mark.parametrize("method", ["paper", "smooth", "learned"])
def test_in_every_method_a_recording_beyond_the_range_is_refused_by_motor_and_time(
    loading: Loading, method: str
) -> None:
    far = angles(motor3=10 + 117 * np.sin(np.pi * TIMES_S / SECONDS))
    refusal = loading(message(far, method=method)).refusal
    assert refusal is not None
    assert refusal.code == "unplayable"
    assert "motor 3 would go to 127.0 deg at 1.5 s; its range is 0 to 120 deg" in refusal.message


@pytest.mark.parametrize("method", ["paper", "smooth"])
def test_so_is_one_beyond_the_patients_limits_by_however_little(loading: Loading, method: str) -> None:
    limits = [(-180.0, 180.0)] * 5
    limits[2] = (5.0, 40.0)
    up = angles(motor3=10 + 30.01 * np.sin(np.pi * TIMES_S / SECONDS))
    assert loading(message(up, method=method)).refusal is None
    refusal = loading(message(up, method=method, limits_deg=tuple(limits))).refusal
    assert refusal is not None
    assert "motor 3 would go to 40.0 deg at 1.5 s; its range is 5 to 40 deg" in refusal.message


def test_the_half_of_an_axis_acceleration_is_for_going_ahead_of_the_reference(loading: Loading) -> None:
    wave = angles(motor4=5.0 * np.sin(2 * np.pi * 3.0 * TIMES_S))
    sharp = (2 * np.pi * 3.0) ** 2 * 5.0 * (1 / (1 + (3 / 6) ** 4))

    def station(acceleration: float) -> StationConfig:
        axes = tuple(
            msgspec.structs.replace(axis, max_speed_deg_s=80.0, max_acceleration_deg_s2=acceleration)
            for axis in StationConfig().axes
        )
        return StationConfig(axes=axes)

    assert loading(message(wave), station(2 * sharp * 1.05)).refusal is None
    refusal = loading(message(wave), station(2 * sharp * 0.95)).refusal
    assert refusal is not None
    assert "motor 4 would jerk at" in refusal.message


def test_the_papers_way_has_all_of_it(loading: Loading) -> None:
    """Samples that go up and down by 9.9 deg in turn: 1,980 deg/s2 at its 10 Hz."""
    stepping = angles(motor4=9.9 * (np.floor(TIMES_S * 10 + 0.5) % 2))
    axes = tuple(msgspec.structs.replace(axis, max_acceleration_deg_s2=3600.0) for axis in StationConfig().axes)
    assert loading(message(stepping, method="paper"), StationConfig(axes=axes)).refusal is None
    refusal = loading(message(stepping), StationConfig(axes=axes)).refusal
    assert refusal is not None
    assert "motor 4 would" in refusal.message


@pytest.mark.parametrize(("cycle_hz", "refused"), [(100, False), (50, False), (125, True)])
def test_the_papers_ten_hertz_must_fit_the_stations_cycles(loading: Loading, cycle_hz: int, refused: bool) -> None:
    config = StationConfig(cycle_hz=cycle_hz, rate_hz=25)
    refusal = loading(message(method="paper"), config).refusal
    assert (refusal is not None) == refused
    assert refusal is None or (refusal.code, refusal.next_step) == ("unusable", "Choose another method.")
    assert loading(message(), config).refusal is None


def test_what_was_learned_goes_with_the_recording(loading: Loading) -> None:
    given = np.random.default_rng(0).uniform(-LARGEST_DEG, LARGEST_DEG, (rows(SECONDS), 5))
    taken = loading(message(method="learned", correction_deg=given.tobytes(), correction_step_s=0.02))
    assert taken.refusal is None
    assert taken.correction is not None
    assert taken.correction.step_s == 0.02
    assert np.array_equal(taken.correction.angles_deg, given)


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"method": "smooth"}, "belongs to the learned method"),
        ({"method": "paper"}, "belongs to the learned method"),
        ({"correction_deg": correction()[:-8]}, "cut short"),
        ({"correction_deg": correction(LARGEST_DEG + 0.001)}, "more than 3 deg"),
        ({"correction_deg": correction(-LARGEST_DEG - 0.001)}, "more than 3 deg"),
        ({"correction_deg": correction(math.nan)}, "more than 3 deg"),
        ({"correction_step_s": 0.0}, "as long as another recording"),
        ({"correction_step_s": -0.02}, "as long as another recording"),
        ({"correction_step_s": math.nan}, "as long as another recording"),
        ({"correction_step_s": math.inf}, "as long as another recording"),
        ({"correction_step_s": 1000.0, "correction_deg": correction(count=2)}, "as long as another recording"),
        ({"correction_step_s": 0.03}, "as long as another recording"),
        ({"correction_deg": correction(count=rows(SECONDS) - 2)}, "as long as another recording"),
        ({"correction_deg": correction(count=rows(SECONDS) + 2)}, "as long as another recording"),
        ({"correction_deg": correction(count=1), "correction_step_s": 3.0}, "as long as another recording"),
    ],
)
def test_what_was_learned_must_be_whole_bounded_and_of_this_recording(
    loading: Loading, changes: dict[str, object], sentence: str
) -> None:
    good = message(method="learned", correction_deg=correction(), correction_step_s=0.02)
    assert loading(good).refusal is None
    refusal = loading(msgspec.structs.replace(good, **changes)).refusal
    assert refusal is not None
    assert refusal.code == "unusable"
    assert sentence in refusal.message


def test_a_correction_at_the_bound_is_good(loading: Loading) -> None:
    for deg in (LARGEST_DEG, -LARGEST_DEG):
        taken = loading(message(method="learned", correction_deg=correction(deg), correction_step_s=0.02))
        assert taken.refusal is None
