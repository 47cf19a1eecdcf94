"""``kata bench bus``: how much of what the line carries our drivers use, beside other people's libraries on the same wire.

A cycle writes five goals and reads position, velocity and current of five drives. The simulated wire takes the real time for
every byte; the ceiling is worked out from the bytes of the very requests that were measured. Everybody runs in a process of
their own, in turns with all others, and the middle of the rounds counts.
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from typing import Final, Literal

from kata.bench.bus_cycle import CycleFigures, CycleOrder
from kata.bench.bus_process_client import bus_process
from kata.bench.other_libraries import installed
from kata.bench.report import Report
from kata.bench.running_service import BenchError
from kata.device import config
from kata.device.ceiling import BITS_A_BYTE, ceiling_hz
from kata.device.config import StationConfig
from kata.simulator.client import SimulatorClient
from kata.simulator.process import SimulatorProcess

_FAST: Final = 1_000_000
_SLOW: Final = 115_200
_WARM_UP: Final = 20
"""Cycles. Also enough for a driver to take a drive that speaks again for sound."""
_SILENT_MOTOR: Final = 3
_DISTURBED_CYCLES: Final = 100
_CYCLES_A_SECOND: Final = 20
"""Of those, when less time is given for each cell."""

_GOALS_BYTES: Final = 39
_SYNC_READ_BYTES: Final = 19 + 5 * 21
_FAST_READ_BYTES: Final = 19 + 8 + 5 * 14
_ANSWER_BYTES: Final = 21
_CYCLE_BYTES: Final = _GOALS_BYTES + (_FAST_READ_BYTES + 2.5) + (14 + 51) + (14 + 17.5)
"""With a drive's status and the inputs; the answers are longer in some cycles than in others, this is the mean."""
_MODBUS_ANSWER_BYTES: Final = 5
"""And two for each register."""

Wire = Literal["dynamixel", "modbus"]


@dataclass(frozen=True)
class Contender:
    """One way to carry out a cycle."""

    host: str
    label: str
    figure: str
    """What its figures' names begin with."""
    needs: str | None = None
    """Somebody else's library: its module."""
    bytes: float = 0.0
    """On the wire in a cycle; Modbus has a calculation of its own."""
    answers: int = 5
    disturbed: bool = True
    """CycleFigures with a silent servo and with noise too."""


DYNAMIXEL: Final = (
    Contender("kata", "kata, Fast Sync Read", "", None, _GOALS_BYTES + _FAST_READ_BYTES, disturbed=False),
    Contender("kata_plain", "kata, Sync Read", "plain_", None, _GOALS_BYTES + _SYNC_READ_BYTES, disturbed=False),
    Contender("kata_cycle", "kata, whole cycle of the loop", "whole_", None, _CYCLE_BYTES, 7),
    Contender(
        "dynamixel_sdk_fast",
        "dynamixel-sdk, Fast Sync Read",
        "dynamixel_sdk_fast_",
        "dynamixel_sdk",
        _GOALS_BYTES + _FAST_READ_BYTES,
    ),
    Contender(
        "dynamixel_sdk", "dynamixel-sdk, Sync Read", "dynamixel_sdk_", "dynamixel_sdk", _GOALS_BYTES + _SYNC_READ_BYTES
    ),
    Contender("rustypot", "rustypot, Sync Read of a block", "rustypot_", "rustypot", _GOALS_BYTES + _SYNC_READ_BYTES),
)
MODBUS: Final = (
    Contender("kata_cycle", "kata, function 23", "modbus_"),
    Contender("pymodbus", "pymodbus, function 23", "pymodbus_", "pymodbus"),
)


@dataclass(frozen=True)
class Rates:
    """What the rounds came to, the middle of each."""

    per_s: float
    ceiling_hz: float
    sd_us: float
    spread_us: float
    cpu_percent: float
    lost: int
    """Answers, of all rounds together."""
    real_time: bool

    @property
    def ratio(self) -> float:
        """Of the ceiling."""
        return self.per_s / self.ceiling_hz


@dataclass(frozen=True)
class DisturbanceCost:
    """What disturbances cost."""

    silent_lost_ms: float
    """A cycle longer than the usual undisturbed one, on average."""
    silent_longest_ms: float
    """The longest cycle with the silent servo."""
    noise_lost: float
    """Good answers that were not taken, of a hundred with noise before them."""
    wasted_bytes: float
    """What they had, of a hundred as well."""


class BusBench:
    """One simulated wire, and everybody's turns on it."""

    def __init__(self, folder: Path, simulator: SimulatorProcess, protocol: Wire, baud: int, delay_us: int) -> None:
        """The drives are set up by our own driver, so that all find the same return delay."""
        # As often as the whole cycle fits on the line: drivers derive from it how long to wait.
        hz = 100 if baud == _FAST else 20
        self._config = StationConfig(
            port=simulator.port, protocol=protocol, baud=baud, return_delay_us=delay_us, cycle_hz=hz, rate_hz=hz
        )
        self._simulator = simulator
        self._station = folder / f"{protocol}-{baud}.toml"
        config.write(self._config, self._station)
        with bus_process("kata_cycle", self._station, real_time=False):
            pass

    def ceiling_hz(self, way: Contender) -> float:
        """Cycles a second at which the line would never be idle."""
        if self._config.protocol == "modbus":
            return ceiling_hz(self._config)
        return 1e6 / (way.bytes * BITS_A_BYTE * 1e6 / self._config.baud + way.answers * self._config.return_delay_us)

    def rate(self, way: Contender, seconds: float, *, real_time: bool) -> tuple[CycleFigures, bool]:
        """Cycles one after the other; and whether SCHED_FIFO was granted."""
        with bus_process(way.host, self._station, real_time=real_time) as host:
            return host.measure(CycleOrder(seconds=seconds, before=_WARM_UP)), host.real_time

    def disturb(self, way: Contender, cycles: int, *, real_time: bool) -> DisturbanceCost:
        """Paced as the control loop is: undisturbed, with a silent servo, and with noise before each answer."""
        hz = self._config.cycle_hz
        with (
            bus_process(way.host, self._station, real_time=real_time) as host,
            closing(self._simulator.client()) as hand,
        ):
            usual = host.measure(CycleOrder(cycles=cycles, before=_WARM_UP, hz=hz))
            with _broken(hand):
                hand.fault("silent", _SILENT_MOTOR)
                silent = host.measure(CycleOrder(cycles=cycles, before=1, hz=hz))
            with _broken(hand):
                host.measure(CycleOrder(cycles=1, before=_WARM_UP, hz=hz))
                hand.fault("noise")
                noisy = host.measure(CycleOrder(cycles=cycles, hz=hz))
        lost = noisy.lost / (5 * noisy.cycles) * 100
        return DisturbanceCost(silent.mean_ms - usual.p50_ms, silent.max_ms, lost, lost * self._answer_bytes)

    @property
    def _answer_bytes(self) -> int:
        if self._config.protocol == "modbus":
            return _MODBUS_ANSWER_BYTES + 2 * self._config.modbus.block_registers
        return _ANSWER_BYTES


@contextmanager
def _broken(hand: SimulatorClient) -> Iterator[None]:
    try:
        yield
    finally:
        hand.clear_faults()


def run(seconds: float, rounds: int, delay_us: int, progress: Callable[[str], None]) -> Report:
    """Measure everything; ``seconds`` for each library on each wire.

    :raises BenchError: when one of our own drivers cannot be measured.
    """
    report = Report(
        f"Bus: five goals written, five drives read, return delay {delay_us} µs",
        (
            "Wire, library",
            "cycles/s",
            "ceiling",
            "%",
            "CPU, %",
            "sd, µs",
            "p99-p50",
            "silent: ms lost",
            "longest",
            "noise: lost, %",
        ),
    )
    cycles = max(5, min(_DISTURBED_CYCLES, round(seconds * _CYCLES_A_SECOND)))
    wires: tuple[tuple[Wire, int, Sequence[Contender]], ...] = (
        ("dynamixel", _FAST, DYNAMIXEL),
        ("dynamixel", _SLOW, DYNAMIXEL),
        ("modbus", _SLOW, MODBUS),
    )
    with TemporaryDirectory(prefix="kata-bench-") as folder:
        for protocol, baud, ways in wires:
            simulator = SimulatorProcess(Path(folder), protocol=protocol, baud=baud, spin=True, still=True)
            try:
                bench = BusBench(Path(folder), simulator, protocol, baud, delay_us)
                name = f"{protocol} {baud}"
                contenders = _select_installed(report, name, ways)
                rates = _rates(bench, contenders, seconds / rounds, rounds, report, progress)
                for way in contenders:
                    if way not in rates:
                        continue
                    progress(f"{name}, {way.label}, disturbed")
                    wanted = way.disturbed and (baud == _FAST or protocol == "modbus")
                    told = bench.disturb(way, cycles, real_time=rates[way].real_time) if wanted else None
                    _tell(report, f"{name}, {way.label}", way.figure, baud, rates[way], told)
                _compare(report, baud, rates)
            finally:
                simulator.close()
    _add_notes(report, seconds, rounds, cycles)
    return report


def _select_installed(report: Report, wire: str, ways: Sequence[Contender]) -> list[Contender]:
    missing = [way for way in ways if way.needs and not installed(way.needs)]
    report.rows += [(f"{wire}, {way.label}", "not installed", *[""] * 8) for way in missing]
    return [way for way in ways if way not in missing]


def _rates(
    bench: BusBench,
    ways: Sequence[Contender],
    seconds: float,
    rounds: int,
    report: Report,
    progress: Callable[[str], None],
) -> dict[Contender, Rates]:
    """Ours with the privileges of the control thread; others with and without, whichever is quicker for them."""
    measured: dict[tuple[Contender, bool], list[CycleFigures]] = {}
    for n in range(rounds):
        for way in ways:
            for real_time in (True, False) if way.needs and report.on.fifo else (report.on.fifo,):
                progress(f"{way.label}, round {n + 1} of {rounds}")
                try:
                    one, granted = bench.rate(way, seconds, real_time=real_time)
                except BenchError as error:
                    if not way.needs:
                        raise
                    report.notes.append(f"{way.label}: {error}.")
                    continue
                measured.setdefault((way, granted), []).append(one)
    best: dict[Contender, Rates] = {}
    for (way, granted), all_of_them in measured.items():
        rates = _median_rates(all_of_them, bench.ceiling_hz(way), real_time=granted)
        if way not in best or rates.per_s > best[way].per_s:
            best[way] = rates
    return {way: best[way] for way in ways if way in best}


def _median_rates(rounds: Sequence[CycleFigures], ceiling: float, *, real_time: bool) -> Rates:
    return Rates(
        per_s=median(one.per_s for one in rounds),
        ceiling_hz=ceiling,
        sd_us=median(one.sd_us for one in rounds),
        spread_us=median(one.spread_us for one in rounds),
        cpu_percent=median(one.cpu_percent for one in rounds),
        lost=sum(one.lost for one in rounds),
        real_time=real_time,
    )


def _tell(report: Report, label: str, figure: str, baud: int, rates: Rates, told: DisturbanceCost | None) -> None:
    report.figures |= {
        f"{figure}cycles_per_s_{baud}": rates.per_s,
        f"{figure}ceiling_ratio_{baud}": rates.ratio,
        f"{figure}cpu_percent_{baud}": rates.cpu_percent,
        f"{figure}jitter_sd_us_{baud}": rates.sd_us,
        f"{figure}jitter_p99_us_{baud}": rates.spread_us,
        f"{figure}answers_lost_{baud}": rates.lost,
    }
    disturbed = ("", "", "")
    if told:
        # What the loop does whole is what a silent servo and noise cost us.
        name = "" if figure == "whole_" else figure
        report.figures |= {
            f"{name}silent_servo_lost_ms": told.silent_lost_ms,
            f"{name}silent_servo_longest_ms": told.silent_longest_ms,
            f"{name}noise_lost_percent": told.noise_lost,
            f"{name}noise_wasted_bytes": told.wasted_bytes,
        }
        disturbed = (f"{told.silent_lost_ms:.2f}", f"{told.silent_longest_ms:.2f}", f"{told.noise_lost:.1f}")
    report.rows.append(
        (
            label if rates.real_time or not report.on.fifo else f"{label} (no FIFO)",
            f"{rates.per_s:.1f}",
            f"{rates.ceiling_hz:.1f}",
            f"{rates.ratio * 100:.1f}",
            f"{rates.cpu_percent:.1f}",
            f"{rates.sd_us:.0f}",
            f"{rates.spread_us:.0f}",
            *disturbed,
        )
    )


def _compare(report: Report, baud: int, rates: dict[Contender, Rates]) -> None:
    """Cycles a second, ours over theirs: each library's best, and beside it over the same bytes."""
    by_host = {way.host: one.per_s for way, one in rates.items()}
    for peer, theirs, ours, equal in (
        ("dynamixel_sdk", ("dynamixel_sdk", "dynamixel_sdk_fast"), "kata", None),
        ("rustypot", ("rustypot",), "kata", "kata_plain"),
        ("pymodbus", ("pymodbus",), "kata_cycle", None),
    ):
        best = max((by_host[host] for host in theirs if host in by_host), default=None)
        if best is None or ours not in by_host:
            continue
        report.figures[f"vs_{peer}_{baud}"] = by_host[ours] / best
        if equal in by_host:
            report.figures[f"plain_vs_{peer}_{baud}"] = by_host[equal] / best
    if {"kata_plain", "dynamixel_sdk"} <= by_host.keys():
        report.figures[f"plain_vs_dynamixel_sdk_{baud}"] = by_host["kata_plain"] / by_host["dynamixel_sdk"]


def _add_notes(report: Report, seconds: float, rounds: int, cycles: int) -> None:
    ratios = [f"{name} {value:.3f}" for name, value in report.figures.items() if "vs_" in name]
    if ratios:
        report.notes.append(f"Our cycles/s over theirs: {', '.join(ratios)}.")
    report.notes += [
        f"{rounds} rounds of {seconds / rounds:g} s each, in turns; the middle one counts. CPU is of one core, the host's process alone.",
        "ceiling: only the bytes of the row's own requests and answers, 10 bits each, return delays, and Modbus' silences.",
        "Others ran with SCHED_FIFO and without, the row has the quicker of both: one who spins with it keeps the kernel's "
        "own worker from moving the pseudo-terminal's bytes.",
        f"silent: mean of {cycles} cycles with motor {_SILENT_MOTOR} of five silent, paced as the loop is, minus the median of undisturbed ones; "
        "the control loop's whole cycle on our side, which is shorter by the silent one's bytes while it is not asked. noise: good answers not taken, of those with 1 to 8 random bytes before them.",
        "rustypot and pymodbus were given a time limit of 20 ms without retries; their documentation's own are longer. "
        "Modbus rows read the two inputs as well.",
    ]
