"""Implements ``python -m benchmarks password-guessing``: measures what an attacker learns, and the effect on the control loop."""

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
from kata.bench.running_service import WITHOUT_REAL_TIME, BenchError, RunningService, prepare_records
from kata.database.base import utc_now
from kata.database.engine import Database

_RATE_HZ: Final = 100
_ATTEMPTS_A_NAME: Final = 4
"""Number of attempts with one name. It is lower than the back-off allows."""
_ATTEMPTS_AN_ADDRESS: Final = 20
_SPARE_S: Final = 60.0
_NAMES: Final = ("p50", "p99", "p999", "max")
_ATTACKS: Final[tuple[tuple[Kind, str], ...]] = (
    ("one", "guessing at one account from one address"),
    ("many", "guessing with another name and address each time"),
)


@dataclass(frozen=True)
class AnswerTimes:
    """Times in ms until the answer to a wrong password, for known and unknown names, measured alternately."""

    known: list[float]
    unknown: list[float]

    @property
    def difference_ms(self) -> float:
        """Difference of the medians in ms, which an attacker could measure."""
        return median(self.known) - median(self.unknown)


def run(seconds: float, per_minute: int, pairs: int, progress: Callable[[str], None]) -> Report:
    """Measure the loop without guessing and with each kind of guessing, for ``seconds`` each, and answer times for ``pairs`` of names.

    :raises BenchError: when the apparatus stops, or a wrong password gets an unexpected answer.
    """
    report = Report(
        f"Sign-in: {per_minute} attempts a minute for {seconds:g} s, and {pairs} pairs of names",
        (
            "Control loop",
            *(f"{name}, ms" for name in ("p50", "p99", "p99.9", "max")),
            "missed",
            "reference p99.9",
            "ratio p99.9",
        ),
    )
    with TemporaryDirectory(prefix="kata-bench-") as folder:
        data = Path(folder)
        records = prepare_records(data, play_s=seconds + _SPARE_S, plot_s=1.0)
        make_accounts(data, max(1, -(-pairs // _ATTEMPTS_A_NAME)))
        progress("Known and unknown names")
        _add_answer_times(report, measure_answer_times(data, records, pairs))
        try:
            _measure_loop(report, data, records, (seconds, per_minute), progress)
        except BenchError as error:
            # Report the answer times even if the loop could not be measured.
            report.notes.append(f"Control loop: no more figures, {error}.")
    report.notes.append("Each measurement has its own service and apparatus; torque is on and a recording plays.")
    report.notes.append("reference: a bare thread at the same time; its lateness is that of the computer.")
    return report


def _measure_loop(
    report: Report, data: Path, records: BenchRecords, how: tuple[float, int], progress: Callable[[str], None]
) -> None:
    seconds, per_minute = how
    case = LoopCase(_RATE_HZ, False, report.on.fifo)
    progress("Control loop without guessing")
    quiet = measure(data, case, records, seconds)
    _add_row(report, "quiet", "without guessing", quiet, quiet)
    for kind, name in _ATTACKS:
        progress(f"Control loop while {name}")
        guessed = GuessingFigures()
        found = measure(data, case, records, seconds, partial(guess_passwords, guessed, per_minute, kind))
        _add_row(report, kind, name, found, quiet)
        _add_guessing_figures(report, kind, name, guessed)


def measure_answer_times(data: Path, records: BenchRecords, pairs: int) -> AnswerTimes:
    """Measure answer times. Names and addresses change often enough to avoid the back-off."""
    known: list[float] = []
    unknown: list[float] = []
    with RunningService(data, records, cycle_hz=_RATE_HZ, rate_hz=_RATE_HZ, settings=WITHOUT_REAL_TIME) as service:
        for n in range(pairs):
            which = n // _ATTEMPTS_A_NAME
            # Alternate the order of the two names, so that the order has no effect.
            both = [(known, f"known-{which}"), (unknown, f"nobody-{which}")]
            for number, (took, name) in enumerate(both if n % 2 else both[::-1]):
                address = f"127.0.2.{(2 * n + number) // _ATTEMPTS_AN_ADDRESS % 250 + 1}"
                answer = guess(service.url, name, "not the password", address)
                if answer.status != 401:
                    raise BenchError(f"a wrong password was answered with {answer.status}")
                took.append(answer.took_ms)
    return AnswerTimes(known, unknown)


def make_accounts(data: Path, count: int) -> None:
    """Create ``count`` therapists with the names known-0, known-1, ... in the database of this folder."""
    database = Database(f"sqlite:///{data / 'kata.db'}")
    try:
        # Use one hash for all accounts, because only wrong passwords are measured.
        password_hash, now = hasher().hash("nobody will guess this one"), utc_now()
        with database.write() as session:
            for n in range(count):
                account = accounts.create(session, f"known-{n}", f"Known {n}", "therapist", (), now)
                accounts.set_password(session, account, password_hash, now)
    finally:
        database.close()


def _add_answer_times(report: Report, found: AnswerTimes) -> None:
    known, unknown = median(found.known), median(found.unknown)
    report.figures |= {
        "known_ms": known,
        "unknown_ms": unknown,
        "known_unknown_difference_ms": found.difference_ms,
        "pairs": len(found.known),
    }
    report.notes.append(
        f"A wrong password is answered within {known:.2f} ms for a known name and {unknown:.2f} ms for an unknown one "
        f"(medians of {len(found.known)} each, in turns): {found.difference_ms:+.2f} ms apart."
    )


def _add_row(report: Report, key: str, label: str, measured: LoopFigures, quiet: LoopFigures) -> None:
    lateness = {name: float(getattr(measured.loop, f"lateness_{name}_ms")) for name in _NAMES}
    before = {name: float(getattr(quiet.loop, f"lateness_{name}_ms")) for name in _NAMES}
    ratios = {name: lateness[name] / before[name] if before[name] else float("nan") for name in _NAMES}
    report.figures |= {f"lateness_{name}_ms_{key}": value for name, value in lateness.items()}
    report.figures |= {f"missed_{key}": measured.missed, f"floor_p999_ms_{key}": measured.reference.p999_ms}
    if key != "quiet":
        report.figures |= {f"lateness_{name}_ratio_{key}": value for name, value in ratios.items()}
    report.rows.append(
        (
            label,
            *(f"{value:.3f}" for value in lateness.values()),
            str(measured.missed),
            f"{measured.reference.p999_ms:.3f}",
            "" if key == "quiet" else f"{ratios['p999']:.2f}",
        )
    )


def _add_guessing_figures(report: Report, key: str, name: str, guessed: GuessingFigures) -> None:
    report.figures |= {
        f"tries_{key}": guessed.attempts,
        f"locked_out_{key}": guessed.locked_out,
        f"weighed_{key}": guessed.checked,
        f"other_answers_{key}": guessed.others,
    }
    first = f", from attempt {guessed.first_locked_out} on" if guessed.first_locked_out else ""
    report.notes.append(
        f"While {name}: {guessed.attempts} attempts, {guessed.locked_out} locked out{first}, {guessed.checked} wrong passwords "
        f"checked, {guessed.others} other answers; answered within {guessed.answer_ms:.1f} ms (median)."
    )
