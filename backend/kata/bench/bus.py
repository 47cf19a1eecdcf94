"""Implements ``kata bench bus``: measures the share of the bus bandwidth that our drivers use, compared with other libraries.

A cycle writes five goals and reads position, velocity and current of five drives. The simulated bus takes the real time for
each byte. The ceiling is calculated from the bytes of the measured requests. Each library runs in its own process. The
libraries are measured in turn, and the figures are medians over the rounds.
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
from kata.device.bus.bandwidth import max_cycle_hz
from kata.device.bus.dynamixel.registers import LENGTHS, ROTATION_BLOCKS
from kata.device.bus.timing import BITS_A_BYTE
from kata.device.bus.verification import cycles_between_reads
from kata.device.config import StationConfig
from kata.simulator.client import SimulatorClient
from kata.simulator.process import Adapter, SimulatorProcess

_FAST: Final = 1_000_000
_SLOW: Final = 115_200
_WARM_UP: Final = 20
"""Number of cycles after which a driver has accepted a drive that answers again."""
_WARM_UP_A_SECOND: Final = 500
"""Cycles before a measurement for each second of a short measuring time. On a slow bus a hundred cycles take seconds."""
_SILENT_MOTOR: Final = 3
_DISTURBED_CYCLES: Final = 100
_CYCLES_A_SECOND: Final = 20
"""Number of disturbed cycles for each second of measuring time, if the measuring time is short."""

_GOALS_BYTES: Final = 39
_SYNC_READ_BYTES: Final = 19 + 5 * 21
_FAST_READ_BYTES: Final = 19 + 8 + 5 * 14
_ANSWER_BYTES: Final = 21
_VERIFIED_BYTES: Final = 14 + 11 + sum(len(block) for block in ROTATION_BLOCKS) / len(ROTATION_BLOCKS)
"""Bytes of request and answer of a read in the rotation that verifies registers, as the mean of its blocks."""
_MODBUS_ANSWER_BYTES: Final = 5
"""Bytes of an answer without the registers, which have two bytes each."""

ProtocolName = Literal["dynamixel", "modbus"]


@dataclass(frozen=True)
class Contender:
    """One library in one mode, which runs the cycle."""

    host: str
    label: str
    figure: str
    """Prefix of the names of its figures."""
    needs: str | None = None
    """Module that must be installed, for other libraries."""
    bytes: float = 0.0
    """Bytes on the bus in a cycle. For Modbus and for the whole cycle they are calculated from the configuration."""
    answers: int = 5
    disturbed: bool = True
    """True if the library is measured with a silent servo and with noise too."""


_WHOLE: Final = Contender("kata_cycle", "kata, whole cycle of the loop", "whole_")
LATENCIES_MS: Final = ((0.25, 0.0), (1.0, 0.0), (1.0, 0.5), (1.0, 1.0), (2.0, 0.0), (4.0, 0.0))
"""Latencies of the adapter: a fixed time, and the maximum of an additional random time."""
DYNAMIXEL: Final = (
    Contender("kata", "kata, Fast Sync Read", "", None, _GOALS_BYTES + _FAST_READ_BYTES, disturbed=False),
    Contender("kata_plain", "kata, Sync Read", "plain_", None, _GOALS_BYTES + _SYNC_READ_BYTES, disturbed=False),
    _WHOLE,
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
    """The rates of a library, as medians over the rounds."""

    per_s: float
    max_cycle_hz: float
    sd_us: float
    spread_us: float
    cpu_percent: float
    lost: int
    """Number of lost answers in all rounds."""
    real_time: bool

    @property
    def ratio(self) -> float:
        """Share of the highest possible rate."""
        return self.per_s / self.max_cycle_hz


@dataclass(frozen=True)
class DisturbanceCost:
    """The cost of a silent servo and of noise."""

    silent_lost_ms: float
    """Mean duration of a cycle with the silent servo, minus the median duration of an undisturbed cycle."""
    silent_longest_ms: float
    """The longest cycle with the silent servo."""
    noise_lost: float
    """Percentage of good answers lost because noise preceded them."""
    wasted_bytes: float
    """Bytes of these lost answers, for each hundred answers."""


class BusBench:
    """One simulated bus on which the libraries are measured in turn."""

    def __init__(
        self, folder: Path, simulator: SimulatorProcess, protocol: ProtocolName, baud: int, delay_us: int
    ) -> None:
        """Configure the drives with our own driver, so that all libraries find the same return delay."""
        # Use the highest rate at which the whole cycle fits on the bus. The drivers derive their time-outs from it.
        hz = 100 if baud == _FAST else 20
        self._config = StationConfig(
            port=simulator.port, protocol=protocol, baud=baud, return_delay_us=delay_us, cycle_hz=hz, rate_hz=hz
        )
        self._simulator = simulator
        self._station = folder / f"{protocol}-{baud}.toml"
        config.write(self._config, self._station)
        with bus_process("kata_cycle", self._station, real_time=False):
            pass

    def max_cycle_hz(self, contender: Contender, latency_ms: float = 0.0) -> float:
        """Return the highest cycle rate that bytes, return delays and the adapter's mean latency allow."""
        if self._config.protocol == "modbus":
            return max_cycle_hz(self._config)
        cycle_bytes, answers, requests = contender.bytes, float(contender.answers), 1.0
        if contender == _WHOLE:
            # The reads of the rotation are added to the read of all drives.
            reads = 1 / cycles_between_reads(5 * len(ROTATION_BLOCKS), self._config.cycle_hz)
            cycle_bytes = _GOALS_BYTES + 19 + 8 + 5 * (4 + sum(LENGTHS) / len(LENGTHS)) + reads * _VERIFIED_BYTES
            answers, requests = answers + reads, requests + reads
        cycle_us = cycle_bytes * BITS_A_BYTE * 1e6 / self._config.baud + answers * self._config.return_delay_us
        return 1e6 / (cycle_us + requests * latency_ms * 1000)

    def rate(self, contender: Contender, seconds: float, *, real_time: bool) -> tuple[CycleFigures, bool]:
        """Measure cycles without a pause. Return their figures, and True if SCHED_FIFO was granted."""
        with bus_process(contender.host, self._station, real_time=real_time) as host:
            return host.measure(CycleOrder(seconds=seconds, before=_warm_up(seconds))), host.real_time

    def paced(self, seconds: float, *, real_time: bool) -> CycleFigures:
        """Measure whole cycles at the control loop's rate."""
        with bus_process(_WHOLE.host, self._station, real_time=real_time) as host:
            order = CycleOrder(
                cycles=max(5, round(seconds * self._config.cycle_hz)),
                before=_warm_up(seconds),
                hz=self._config.cycle_hz,
            )
            return host.measure(order)

    def disturb(self, contender: Contender, cycles: int, *, real_time: bool) -> DisturbanceCost:
        """Measure at the control loop's rate: undisturbed, with a silent servo, and with noise before each answer."""
        hz = self._config.cycle_hz
        with (
            bus_process(contender.host, self._station, real_time=real_time) as host,
            closing(self._simulator.client()) as simulator,
        ):
            usual = host.measure(CycleOrder(cycles=cycles, before=_WARM_UP, hz=hz))
            with _clear_faults_afterwards(simulator):
                simulator.fault("silent", _SILENT_MOTOR)
                silent = host.measure(CycleOrder(cycles=cycles, before=1, hz=hz))
            with _clear_faults_afterwards(simulator):
                host.measure(CycleOrder(cycles=1, before=_WARM_UP, hz=hz))
                simulator.fault("noise")
                noisy = host.measure(CycleOrder(cycles=cycles, hz=hz))
        percent = noisy.lost / (5 * noisy.cycles) * 100
        return DisturbanceCost(silent.mean_ms - usual.p50_ms, silent.max_ms, percent, percent * self._answer_bytes)

    @property
    def _answer_bytes(self) -> int:
        if self._config.protocol == "modbus":
            return _MODBUS_ANSWER_BYTES + 2 * self._config.modbus.block_registers
        return _ANSWER_BYTES


def _warm_up(seconds: float) -> int:
    """Return the number of cycles before a measurement of ``seconds``."""
    return max(_WARM_UP, min(5 * _WARM_UP, round(seconds * _WARM_UP_A_SECOND)))


@contextmanager
def _clear_faults_afterwards(simulator: SimulatorClient) -> Iterator[None]:
    try:
        yield
    finally:
        simulator.clear_faults()


def run(seconds: float, rounds: int, delay_us: int, progress: Callable[[str], None]) -> Report:
    """Measure every library for ``seconds`` on each bus.

    :raises BenchError: when one of our own drivers cannot be measured.
    """
    report = Report(
        f"Bus: five goals written, five drives read, return delay {delay_us} µs",
        (
            "Bus, library",
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
    buses: tuple[tuple[ProtocolName, int, Sequence[Contender]], ...] = (
        ("dynamixel", _FAST, DYNAMIXEL),
        ("dynamixel", _SLOW, DYNAMIXEL),
        ("modbus", _SLOW, MODBUS),
    )
    with TemporaryDirectory(prefix="kata-bench-") as folder:
        for protocol, baud, contenders in buses:
            simulator = SimulatorProcess(Path(folder), protocol=protocol, baud=baud, plant="none")
            try:
                bench = BusBench(Path(folder), simulator, protocol, baud, delay_us)
                name = f"{protocol} {baud}"
                contenders = _select_installed(report, name, contenders)
                rates = _rates(bench, contenders, seconds / rounds, rounds, report, progress)
                for contender in contenders:
                    if contender not in rates:
                        continue
                    progress(f"{name}, {contender.label}, disturbed")
                    disturb = contender.disturbed and (baud == _FAST or protocol == "modbus")
                    cost = bench.disturb(contender, cycles, real_time=rates[contender].real_time) if disturb else None
                    _add_row(report, f"{name}, {contender.label}", contender.figure, baud, rates[contender], cost)
                _compare(report, baud, rates)
            finally:
                simulator.close()
        _measure_latencies(Path(folder), seconds, delay_us, report, progress)
    _add_notes(report, seconds, rounds, cycles)
    return report


def _measure_latencies(
    folder: Path, seconds: float, delay_us: int, report: Report, progress: Callable[[str], None]
) -> None:
    """Measure the whole cycle with adapters of different latency, without a pause and at the control loop's rate."""
    for fixed_ms, jitter_ms in LATENCIES_MS:
        name = f"{fixed_ms:g} ms" + (f" to {fixed_ms + jitter_ms:g} ms" if jitter_ms else "")
        progress(f"adapter latency {name}")
        simulator = SimulatorProcess(
            folder, baud=_FAST, plant="none", adapter=Adapter(latency_ms=(fixed_ms, jitter_ms))
        )
        try:
            bench = BusBench(folder, simulator, "dynamixel", _FAST, delay_us)
            figures, real_time = bench.rate(_WHOLE, seconds / len(LATENCIES_MS), real_time=report.on.fifo)
            paced = bench.paced(seconds / len(LATENCIES_MS), real_time=report.on.fifo)
            rates = _median_rates([figures], bench.max_cycle_hz(_WHOLE, fixed_ms + jitter_ms / 2), real_time=real_time)
            figure = f"latency_{fixed_ms:g}_{fixed_ms + jitter_ms:g}_"
            _add_row(report, f"dynamixel {_FAST}, whole cycle, adapter {name} late", figure, _FAST, rates, None)
            report.figures |= {
                f"{figure}inputs_lost_{_FAST}": figures.inputs_lost,
                f"{figure}inputs_lost_100hz_{_FAST}": paced.inputs_lost,
            }
        finally:
            simulator.close()


def _select_installed(report: Report, bus: str, contenders: Sequence[Contender]) -> list[Contender]:
    missing = [contender for contender in contenders if contender.needs and not installed(contender.needs)]
    report.rows += [(f"{bus}, {contender.label}", "not installed", *[""] * 8) for contender in missing]
    return [contender for contender in contenders if contender not in missing]


def _rates(
    bench: BusBench,
    contenders: Sequence[Contender],
    seconds: float,
    rounds: int,
    report: Report,
    progress: Callable[[str], None],
) -> dict[Contender, Rates]:
    """Measure our drivers with the control thread's privileges. Measure other libraries with and without them, and use the
    faster result.
    """
    measured: dict[tuple[Contender, bool], list[CycleFigures]] = {}
    for n in range(rounds):
        for contender in contenders:
            for real_time in (True, False) if contender.needs and report.on.fifo else (report.on.fifo,):
                progress(f"{contender.label}, round {n + 1} of {rounds}")
                try:
                    figures, granted = bench.rate(contender, seconds, real_time=real_time)
                except BenchError as error:
                    if not contender.needs:
                        raise
                    report.notes.append(f"{contender.label}: {error}.")
                    continue
                measured.setdefault((contender, granted), []).append(figures)
    best: dict[Contender, Rates] = {}
    for (contender, granted), all_rounds in measured.items():
        rates = _median_rates(all_rounds, bench.max_cycle_hz(contender), real_time=granted)
        if contender not in best or rates.per_s > best[contender].per_s:
            best[contender] = rates
    return {contender: best[contender] for contender in contenders if contender in best}


def _median_rates(rounds: Sequence[CycleFigures], ceiling: float, *, real_time: bool) -> Rates:
    return Rates(
        per_s=median(figures.per_s for figures in rounds),
        max_cycle_hz=ceiling,
        sd_us=median(figures.sd_us for figures in rounds),
        spread_us=median(figures.spread_us for figures in rounds),
        cpu_percent=median(figures.cpu_percent for figures in rounds),
        lost=sum(figures.lost for figures in rounds),
        real_time=real_time,
    )


def _add_row(report: Report, label: str, figure: str, baud: int, rates: Rates, cost: DisturbanceCost | None) -> None:
    report.figures |= {
        f"{figure}cycles_per_s_{baud}": rates.per_s,
        f"{figure}ceiling_ratio_{baud}": rates.ratio,
        f"{figure}cpu_percent_{baud}": rates.cpu_percent,
        f"{figure}jitter_sd_us_{baud}": rates.sd_us,
        f"{figure}jitter_p99_us_{baud}": rates.spread_us,
        f"{figure}answers_lost_{baud}": rates.lost,
    }
    disturbed = ("", "", "")
    if cost:
        # For our driver, report the cost in the control loop's whole cycle.
        name = "" if figure == "whole_" else figure
        report.figures |= {
            f"{name}silent_servo_lost_ms": cost.silent_lost_ms,
            f"{name}silent_servo_longest_ms": cost.silent_longest_ms,
            f"{name}noise_lost_percent": cost.noise_lost,
            f"{name}noise_wasted_bytes": cost.wasted_bytes,
        }
        disturbed = (f"{cost.silent_lost_ms:.2f}", f"{cost.silent_longest_ms:.2f}", f"{cost.noise_lost:.1f}")
    report.rows.append(
        (
            label if rates.real_time or not report.on.fifo else f"{label} (no FIFO)",
            f"{rates.per_s:.1f}",
            f"{rates.max_cycle_hz:.1f}",
            f"{rates.ratio * 100:.1f}",
            f"{rates.cpu_percent:.1f}",
            f"{rates.sd_us:.0f}",
            f"{rates.spread_us:.0f}",
            *disturbed,
        )
    )


def _compare(report: Report, baud: int, rates: dict[Contender, Rates]) -> None:
    """Add the ratios of our cycle rate to that of each library: to its best mode, and for the same number of bytes."""
    by_host = {contender.host: figures.per_s for contender, figures in rates.items()}
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
        f"{rounds} rounds of {seconds / rounds:g} s each, in turns; the median counts. CPU: percent of one core, of the library's process.",
        "ceiling: from the bytes of the row's own requests and answers at 10 bits each, return delays, Modbus' silences and the "
        "adapter's mean latency.",
        "Other libraries ran with and without SCHED_FIFO; the row has the faster result. A library that busy-waits with "
        "SCHED_FIFO keeps the kernel worker from moving the pseudo-terminal's bytes.",
        f"silent: mean of {cycles} cycles with motor {_SILENT_MOTOR} of five silent, at the loop's pace, minus the median undisturbed cycle. "
        "Ours is the control loop's whole cycle; while it skips the silent drive, it has fewer bytes. "
        "noise: good answers lost, of those with 1 to 8 random bytes before them.",
        "rustypot and pymodbus use a time-out of 20 ms without retries; their documentation uses longer ones. "
        "Modbus rows also read the two inputs.",
    ]
