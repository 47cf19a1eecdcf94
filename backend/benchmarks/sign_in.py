"""``kata bench sign-in``: what somebody who guesses passwords learns, and what it costs the control loop."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from typing import Final

from benchmarks.password_guessing import GuessingFigures, Kind, guess, guess_passwords
from kata.auth import accounts
from kata.auth.passwords import hasher
from kata.bench.loop import LoopCase, LoopFigures, measure
from kata.bench.records import BenchRecords
from kata.bench.report import Report
from kata.bench.running_service import BenchError, RunningService, prepare_records
from kata.database.base import utc_now
from kata.database.engine import Database

_RATE_HZ: Final = 100
_TRIES_A_NAME: Final = 4
"""Fewer than the back-off lets pass."""
_TRIES_AN_ADDRESS: Final = 20
_SPARE_S: Final = 60.0
_NAMES: Final = ("p50", "p99", "p999", "max")
_ATTACKS: Final[tuple[tuple[Kind, str], ...]] = (
    ("one", "a storm at one account from one address"),
    ("many", "a storm of other names from other addresses each time"),
)


@dataclass(frozen=True)
class AnswerTimes:
    """Until the answer to a wrong password, ms, one known name and one unknown by turns."""

    known: list[float]
    unknown: list[float]

    @property
    def difference_ms(self) -> float:
        """Of the medians: what somebody could learn who asks often enough."""
        return median(self.known) - median(self.unknown)


def run(seconds: float, per_minute: int, pairs: int, progress: Callable[[str], None]) -> Report:
    """Measure the loop without a storm and within each, ``seconds`` each time, and answers for ``pairs`` of names.

    :raises BenchError: when the apparatus stops, or an answer is none that a wrong password has.
    """
    report = Report(
        f"Sign-in: {per_minute} tries a minute for {seconds:g} s, and {pairs} pairs of names",
        (
            "Control loop",
            *(f"{name}, ms" for name in ("p50", "p99", "p99.9", "max")),
            "missed",
            "witness p99.9",
            "ratio p99.9",
        ),
    )
    with TemporaryDirectory(prefix="kata-bench-") as folder:
        data = Path(folder)
        records = prepare_records(data, play_s=seconds + _SPARE_S, plot_s=1.0)
        make_accounts(data, max(1, -(-pairs // _TRIES_A_NAME)))
        progress("Known and unknown names")
        _tell_times(report, times(data, records, pairs))
        try:
            _measure_loop(report, data, records, (seconds, per_minute), progress)
        except BenchError as error:
            # What is known of the names is told all the same.
            report.notes.append(f"Control loop: no more figures, {error}.")
    report.notes.append("Each time with a service and an apparatus of its own; torque is on and a recording plays.")
    report.notes.append("witness: a bare thread at the same time; what it is late is the computer's own doing.")
    return report


def _measure_loop(
    report: Report, data: Path, records: BenchRecords, how: tuple[float, int], progress: Callable[[str], None]
) -> None:
    seconds, per_minute = how
    case = LoopCase(_RATE_HZ, False, report.on.fifo)
    progress("Control loop without a storm")
    quiet = measure(data, case, records, seconds)
    _tell(report, "quiet", "without a storm", quiet, quiet)
    for kind, name in _ATTACKS:
        progress(f"Control loop in {name}")
        guessed = GuessingFigures()
        found = measure(data, case, records, seconds, partial(guess_passwords, guessed, per_minute, kind))
        _tell(report, kind, name, found, quiet)
        _tell_storm(report, kind, name, guessed)


def times(data: Path, records: BenchRecords, pairs: int) -> AnswerTimes:
    """Nobody else asks meanwhile. Names and addresses change often enough that the back-off holds nobody up."""
    known: list[float] = []
    unknown: list[float] = []
    with RunningService(data, records, cycle_hz=_RATE_HZ, rate_hz=_RATE_HZ, real_time=False) as service:
        for n in range(pairs):
            which = n // _TRIES_A_NAME
            # In turn the one and the other first, so that what comes second gains nothing by it.
            both = [(known, f"known-{which}"), (unknown, f"nobody-{which}")]
            for number, (took, name) in enumerate(both if n % 2 else both[::-1]):
                address = f"127.0.2.{(2 * n + number) // _TRIES_AN_ADDRESS % 250 + 1}"
                answer = guess(service.url, name, "not the password", address)
                if answer.status != 401:
                    raise BenchError(f"a wrong password was answered with {answer.status}")
                took.append(answer.took_ms)
    return AnswerTimes(known, unknown)


def make_accounts(data: Path, count: int) -> None:
    """Therapists called known-0 and so on, in the database of this folder."""
    database = Database(f"sqlite:///{data / 'kata.db'}")
    try:
        # One hash for all: what is measured is how long a wrong password takes, and it is never the right one.
        kept, now = hasher().hash("nobody will guess this one"), utc_now()
        with database.write() as session:
            for n in range(count):
                account = accounts.create(session, f"known-{n}", f"Known {n}", "therapist", (), now)
                accounts.set_password(session, account, kept, now)
    finally:
        database.close()


def _tell_times(report: Report, found: AnswerTimes) -> None:
    known, unknown = median(found.known), median(found.unknown)
    report.figures |= {
        "known_ms": known,
        "unknown_ms": unknown,
        "known_unknown_difference_ms": found.difference_ms,
        "pairs": len(found.known),
    }
    report.notes.append(
        f"A wrong password is answered within {known:.2f} ms for a known name and {unknown:.2f} ms for an unknown one "
        f"(medians of {len(found.known)} each, by turns): {found.difference_ms:+.2f} ms apart."
    )


def _tell(report: Report, key: str, name: str, measured: LoopFigures, quiet: LoopFigures) -> None:
    told = {one: float(getattr(measured.loop, f"lateness_{one}_ms")) for one in _NAMES}
    before = {one: float(getattr(quiet.loop, f"lateness_{one}_ms")) for one in _NAMES}
    ratios = {one: told[one] / before[one] if before[one] else float("nan") for one in _NAMES}
    report.figures |= {f"lateness_{one}_ms_{key}": value for one, value in told.items()}
    report.figures |= {f"missed_{key}": measured.missed, f"floor_p999_ms_{key}": measured.reference.p999_ms}
    if key != "quiet":
        report.figures |= {f"lateness_{one}_ratio_{key}": value for one, value in ratios.items()}
    report.rows.append(
        (
            name,
            *(f"{value:.3f}" for value in told.values()),
            str(measured.missed),
            f"{measured.reference.p999_ms:.3f}",
            "" if key == "quiet" else f"{ratios['p999']:.2f}",
        )
    )


def _tell_storm(report: Report, key: str, name: str, guessed: GuessingFigures) -> None:
    report.figures |= {
        f"tries_{key}": guessed.tries,
        f"locked_out_{key}": guessed.locked_out,
        f"weighed_{key}": guessed.weighed,
        f"other_answers_{key}": guessed.others,
    }
    first = f", from try {guessed.first_locked_out} on" if guessed.first_locked_out else ""
    report.notes.append(
        f"In {name}: {guessed.tries} tries, {guessed.locked_out} locked out{first}, {guessed.weighed} passwords looked at and "
        f"wrong, {guessed.others} other answers; answered within {guessed.answer_ms:.1f} ms (median)."
    )
