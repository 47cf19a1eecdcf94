"""The technician tunes position gains: measured, proposed, compared, taken back, recorded."""

import itertools
import re
from collections.abc import Callable
from datetime import UTC, datetime

import pytest
from msgspec import structs

from kata.cli.commission_gains import choice_of, review_lines
from kata.commissioning import gains, texts
from kata.commissioning.gain_proposal import Gains
from kata.commissioning.gains_review import GainsChoice, GainSet, GainsReview
from kata.commissioning.live_drives import LiveDrives, LiveSample
from kata.commissioning.procedure import STEPS, begin_record, run_step, with_step
from kata.commissioning.record import RecordedStep, configuration_of
from kata.commissioning.workbench import ManualAction, Workbench
from kata.device.config import StationConfig, simulated
from kata.evaluation.world import World
from kata.motion.axes import AXES
from kata.reporting.charts import Curve, step_responses
from kata.reporting.letterhead import Letterhead
from kata.reporting.rendering import PrintOptions, commissioning_page

KEEP, TAKE_BACK = GainsChoice("keep"), GainsChoice("take_back")
STEP = next(step for step in STEPS if step.key == "gains")
Answer = Callable[[GainsReview], GainsChoice]


def keep(review: GainsReview) -> GainsChoice:
    return KEEP


def take_back(review: GainsReview) -> GainsChoice:
    return TAKE_BACK


def measure_proposed(review: GainsReview) -> GainsChoice:
    return GainsChoice("measure", tuple(motor.proposed for motor in review.motors))


def measure(motor: int, changed: Gains) -> Answer:
    def answer(review: GainsReview) -> GainsChoice:
        present = [motor.gains for motor in review.motors]
        present[motor - 1] = changed
        return GainsChoice("measure", tuple(present))

    return answer


def has_torque(world: World) -> bool:
    """Return True if a drive has torque, as soon as the last request has passed the bus."""
    world.wait(0.01)
    return any(drive.torque_on for drive in world.apparatus.drives)


class Scripted:
    """A technician who gives these answers to the reviews, then keeps the gains."""

    def __init__(self, world: World, *answers: Answer) -> None:
        self._world = world
        self._answers = itertools.chain(answers, itertools.repeat(keep))
        self.instructions: list[ManualAction] = []
        self.torque_at_review: list[bool] = []

    @property
    def reviews(self) -> list[GainsReview]:
        return [instruction.review for instruction in self.instructions if instruction.review]

    def instruct(self, instruction: ManualAction) -> None:
        """Take note."""
        self.instructions.append(instruction)
        if instruction.review:
            self.torque_at_review.append(has_torque(self._world))

    def has_confirmed(self) -> bool:
        """Agree."""
        return True

    def gains_choice(self) -> GainsChoice:
        """Give the next answer."""
        review = self.instructions[-1].review
        assert review
        return next(self._answers)(review)


Kept = tuple[RecordedStep, Scripted, StationConfig]
"""The step that tuned gains, the technician, and the configuration afterwards."""
Improved = tuple[StationConfig, RecordedStep, Scripted, StationConfig]
"""A configuration, the step that tuned its gains, the technician, and the configuration afterwards."""


def with_gains(**changed: Gains) -> StationConfig:
    """Return the simulated station with other gains: ``m3=Gains(...)`` for motor 3."""
    config = simulated("virtual")
    axes = tuple(
        structs.replace(axis, position_p_gain=own.p, position_i_gain=own.i, position_d_gain=own.d)
        if (own := changed.get(f"m{motor}"))
        else axis
        for motor, axis in enumerate(config.axes, start=1)
    )
    return structs.replace(config, axes=axes)


def tuned(config: StationConfig, *answers: Answer) -> tuple[RecordedStep, Scripted, StationConfig]:
    world = World(config)
    technician = Scripted(world, *answers)
    workbench = Workbench(config, technician, world.open_transport, world.wait, lambda: world.t_ns)
    ran = run_step(STEP, workbench, lambda: datetime(2026, 1, 5, tzinfo=UTC))
    assert not has_torque(world)
    return ran, technician, workbench.draft


def gains_of(config: StationConfig) -> GainSet:
    return tuple(Gains(axis.position_p_gain, axis.position_i_gain, axis.position_d_gain) for axis in config.axes)


def values(ran: RecordedStep, motor: int) -> dict[str, tuple[object, object]]:
    return {value.name: (value.before, value.after) for value in ran.values if value.motor == motor}


REFUSED = measure(3, Gains(799, 800, 720)), measure(3, Gains(1600, 800, 1441)), take_back
"""Choices outside the limits, and taking back what was not tried."""


@pytest.fixture(scope="module")
def kept() -> Kept:
    """Tune good gains: refused choices, then a worse trial that is taken back."""
    return tuned(simulated("virtual"), *REFUSED, measure(3, Gains(1600, 800, 360)), take_back)


@pytest.mark.campaign
def test_good_gains_are_kept(kept: Kept) -> None:
    ran, technician, draft = kept
    assert ran.passed and draft == simulated("virtual")
    first, *_, empty = technician.reviews
    assert (first.load, empty.load) == ("weight", "empty")
    assert all(motor.proposed == motor.gains for review in (first, empty) for motor in review.motors)
    assert len(ran.curves) == 10
    assert technician.torque_at_review == [False] * 7, "the technician compares without torque"


POOR = {
    "too little damping": Gains(1600, 800, 120),
    "far too much P": Gains(6400, 800, 400),
    "slow": Gains(400, 100, 720),
}


# In every run, `improved` begins with too little damping, test_a_faulty_begin_is_not_measured_again ends with gains within the limits after
# three proposals, and test_gain_proposal.py proposes from each response.
@pytest.mark.campaign
@pytest.mark.parametrize("poor", POOR.values(), ids=POOR)
def test_proposals_improve_poor_gains(poor: Gains) -> None:
    ran, technician, draft = tuned(with_gains(m3=poor), *[measure_proposed] * 3)
    first, *_, last = [review.motors[2] for review in technician.reviews if review.load == "weight"]
    assert first.response and last.response and first.advice
    assert first.response.overshoot > 0.2 or first.response.rise_s > 0.9
    assert last.response.overshoot <= 0.15 and last.response.rise_s < 0.5 and last.response.steady_error_deg < 0.1
    assert ran.passed and gains_of(draft)[2] == last.gains != poor


@pytest.fixture(scope="module")
def improved() -> Improved:
    """Return a configuration with too little damping, and how its gains were tuned once as proposed."""
    config = with_gains(m3=Gains(1600, 800, 300))
    return config, *tuned(config, measure_proposed)


def test_accepted_gains_are_in_configuration_and_record(improved: Improved) -> None:
    config, ran, technician, draft = improved
    record = with_step(begin_record(config, "test"), ran, draft)
    accepted = gains_of(configuration_of(record))[2]
    assert accepted.d > 400
    found = values(ran, 3)
    assert found["d gain"] == (300, accepted.d)
    for load in ("weight", "empty"):
        before, after = found[f"overshoot %, {load}"]
        assert isinstance(before, int) and isinstance(after, int) and after < before
    assert {(curve.load, curve.d_gain) for curve in ran.curves if curve.motor == 3} == {
        (load, d) for load in ("weight", "empty") for d in (300, accepted.d)
    }, "both responses with each load"
    # The technician has seen the new response beside the old one, with each load.
    for review in technician.reviews[1:]:
        assert len(review.curves) == len(review.former_curves) == 5
        assert review.motors[2].former_gains == Gains(1600, 800, 300) and review.motors[2].former_response


def test_a_worse_trial_is_taken_back_in_one_press(kept: Kept) -> None:
    ran, technician, _ = kept
    first, *_, worse, again, _ = technician.reviews
    assert worse.motors[2].response and worse.motors[2].former_response
    assert worse.motors[2].response.overshoot > worse.motors[2].former_response.overshoot
    assert again.curves == first.curves, "without another measurement"
    assert values(ran, 3)["d gain"] == (720, 720)


@pytest.mark.campaign
def test_gains_changed_when_empty_are_measured_with_weight() -> None:
    ran, technician, draft = tuned(simulated("virtual"), keep, measure(5, Gains(150, 120, 150)), keep)
    assert [review.load for review in technician.reviews] == ["weight", "empty", "empty", "weight"]
    assert ran.passed and gains_of(draft)[4] == Gains(150, 120, 150)
    assert {curve.load for curve in ran.curves if curve.motor == 5 and curve.p_gain == 150} == {"weight", "empty"}


def test_a_choice_outside_the_limits_is_asked_again(kept: Kept) -> None:
    _, technician, _ = kept
    first, *again = technician.reviews[: 1 + len(REFUSED)]
    assert [review.load for review in again] == ["weight"] * len(REFUSED), "each choice is asked again"
    assert all(review.curves == first.curves for review in again), "without a measurement"


def test_kept_gains_that_vibrate_are_refused() -> None:
    config = with_gains(m4=Gains(1600, 800, 0))
    ran, technician, draft = tuned(config)
    assert not ran.passed and ran.fault_key and draft == config
    assert (ran.fault_key.code, ran.fault_key.params["motor"]) == (texts.OVERSHOOT_TOO_LARGE.code, 4)
    assert technician.reviews[0].fault == ran.fault, "shown before it is kept"
    assert ran.curves and values(ran, 4)["d gain"] == (0, 0)


@pytest.mark.campaign
def test_a_faulty_begin_is_not_measured_again() -> None:
    ran, technician, _ = tuned(with_gains(m4=Gains(1600, 800, 0)), *[measure_proposed] * 3)
    assert ran.passed, ran.fault
    assert technician.reviews[-1].load == "empty" and not technician.reviews[-1].former_curves


def test_unstable_gains_end_the_measurement_without_torque(monkeypatch: pytest.MonkeyPatch) -> None:
    """A drive runs away during the second measurement."""
    measured = 0
    begin, cycle = LiveDrives.begin, LiveDrives.cycle

    def begun(drives: LiveDrives) -> None:
        nonlocal measured
        measured += 1
        begin(drives)

    def pushed(drives: LiveDrives) -> LiveSample:
        sample = cycle(drives)
        if measured == 2 and drives.setpoint_deg[2] - sample.angle_deg[2] > 1.5:
            drives.angle_deg[2] += 3 * gains.LARGEST_DISTANCE_DEG
            monkeypatch.setattr(drives, "_cycle", tuple)
        return sample

    monkeypatch.setattr(LiveDrives, "begin", begun)
    monkeypatch.setattr(LiveDrives, "cycle", pushed)
    ran, technician, draft = tuned(simulated("virtual"), measure(3, Gains(1700, 800, 720)), take_back)
    _, unstable, after, _ = technician.reviews
    assert unstable.fault == texts.MOTOR_UNSTABLE(motor=3)
    assert [motor.response is None for motor in unstable.motors] == [False, False, True, True, True]
    assert technician.torque_at_review == [False] * 4
    assert not after.fault and ran.passed and draft == simulated("virtual")


def test_the_emergency_stop_ends_a_measurement() -> None:
    world = World(simulated("virtual"))
    technician = Scripted(world)
    pressed = 0

    def wait(seconds: float) -> None:
        nonlocal pressed
        if any(drive.torque_on for drive in world.apparatus.drives):
            pressed += 1
            world.apparatus.press_estop(pressed > 200)
        world.wait(seconds)

    workbench = Workbench(world.config, technician, world.open_transport, wait, lambda: world.t_ns)
    ran = run_step(STEP, workbench, lambda: datetime(2026, 1, 5, tzinfo=UTC))
    assert ran.fault == texts.ESTOP_DURING_STEP()
    assert not has_torque(world)


def test_print_tells_former_and_kept_response_apart(improved: Improved) -> None:
    config, ran, _, draft = improved
    by_load = step_responses(ran.curves)
    assert list(by_load) == ["weight", "empty"]
    for drawn in by_load.values():
        assert [[line.name for line in chart.lines] for chart in drawn] == [
            ["reference", "former", "kept"] if motor == 3 else ["reference", "kept"] for motor in AXES
        ]
        former, kept = drawn[2].lines[1:]
        assert peak(former) > peak(kept)
    page = commissioning_page(
        with_step(begin_record(config, "test"), ran, draft),
        PrintOptions(Letterhead(""), "en", "UTC", datetime.now(UTC)),
    )
    looks = dict(re.findall(r'<polyline points="([^"]*)" (.*?)/>', page.html))
    assert "dasharray" in looks[former.points] and "dasharray" not in looks[kept.points]


def peak(curve: Curve) -> float:
    """Return the height of the highest point. In a chart, y points downwards."""
    return -min(float(point.split(",")[1]) for point in curve.points.split())


# -- in the terminal ---------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def compared(improved: Improved) -> GainsReview:
    """Return a review with the responses of other gains."""
    _, _, technician, _ = improved
    return technician.reviews[1]


def test_the_terminal_plots_both_responses(compared: GainsReview) -> None:
    text = review_lines(compared)
    assert "motor 3: * now, o former, - step" in text and "motor 4: *" not in text
    plot = [line.split("|", 1)[1] for line in text.splitlines() if "|" in line]
    assert len(plot) == 10 and {len(row) for row in plot} == {60}
    assert "o" in plot[0], "the former response overshoots most"
    assert "*" in plot[-1][:3] + plot[-2][:6] and "".join(plot).count("*") > 30
    rows = [line.split() for line in text.splitlines() if line.split()[:1] == ["3"]]
    assert [row[1] for row in rows[:2]] == ["former", "now"]
    assert float(rows[0][6]) > float(rows[1][6]), "overshoot of both"


def test_the_terminal_reads_what_is_chosen(compared: GainsReview) -> None:
    d = compared.motors[2].gains.d
    assert choice_of("\n", compared) == KEEP
    assert choice_of("u\n", compared) == TAKE_BACK
    assert choice_of("p\n", compared) == measure_proposed(compared)
    assert choice_of(f"3 1600 800 {d + 10}\n", compared) == measure(3, Gains(1600, 800, d + 10))(compared)
    for refused in (f"3 1600 800 {4 * d}", "6 1600 800 720", "3 1600 800", "3 1600 800 x", "what", "0 1 2 3"):
        assert choice_of(refused, compared) is None, refused
    first = structs.replace(
        compared, motors=tuple(structs.replace(motor, former_gains=None) for motor in compared.motors)
    )
    assert choice_of("u", first) is None, "nothing to take back"
