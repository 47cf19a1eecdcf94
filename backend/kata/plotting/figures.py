"""Builds Plotly figures in a worker process, because a long plot would block the service's heartbeats."""

import base64
import json
import multiprocessing
import os
import re
import signal
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Final, Literal, TypeVar

import numpy as np
from anyio import CapacityLimiter

from kata.database.arrays import Floats, UnreadableError, decode
from kata.database.series import Series, unpack, unpack_within
from kata.device.journal import PHASE_PLAYING, PHASE_REDUCED_RANGE
from kata.errors import ProblemError
from kata.motion.axes import AXES
from kata.motion.edit import Motion, PlaybackSettings, with_settings
from kata.motion.tracking import compare, wall_clock_s
from kata.plotting import downsampling, texts
from kata.plotting.colours import INDIGO, ORANGE, PALE_GREEN
from kata.plotting.placed_texts import with_texts
from kata.system import malloc
from kata.system.lazy_modules import delay_unused_numpy

_CHUNK_CHARACTERS: Final = 1 << 18
Clock = Literal["path", "wall"]
"""Clock of a run's comparison: the position on the motion, or the wall-clock time since it began."""
Window = tuple[float, float]
"""Start and end of a time window, in seconds on the figure's clock."""
_Layout = dict[str, Any]
_Trace = dict[str, Any]
_Built = TypeVar("_Built")
_EXPORTS_AT_ONCE: Final = 2
"""Maximum number of export threads. More threads would not finish a file earlier, but would compete with the event loop, and
so with Stop.
"""
_LARGEST_WORKER_BYTES: Final = 70 << 20
"""Private memory of a worker that is still used for the next task. A worker has 20 MB at its start, 30 MB after figures and results of a
playback of 26 minutes, and 66 MB after the first check of a programme or rhythm, which import the library of the database. A new worker needs
two seconds for that. Printed reports and exports of samples leave more.
"""
_NICENESS: Final = 10
"""Niceness of the worker, so that the service and its heartbeats have priority over figures."""
_COMMON: Final = {
    "margin": {"l": 60, "r": 60, "t": 30, "b": 45},
    "legend": {"orientation": "h", "y": 1.02, "yanchor": "bottom", "x": 0},
    "hovermode": "x unified",
    "font": {"family": "system-ui, sans-serif", "size": 13},
}
_FIXED_MARGIN: Final = {"automargin": False}
"""The numbers of an angle fit into the margins above. Without this, Plotly measures them and draws the axes a second time."""


_TEMPLATE: Final = Path("package_data", "templates", "plotly_white.json")
"""File of the template in Plotly's package."""
_ROW_GAP: Final = 0.03
"""Space between two rows, as a share of the figure."""


@dataclass(frozen=True)
class RecordingFigureSamples:
    """Data of a recording's figure: either the downsampled lines or samples. With a ``window``, the samples include those of the window."""

    taught: Series | None
    downsampled: bytes | None
    window: Window | None


@dataclass(frozen=True)
class RunFigureSamples:
    """Data of a run's figures: its downsampled lines, or the taught samples with the settings and the run's own samples."""

    taught: Series | None
    played: Series | None
    asked: PlaybackSettings
    downsampled: bytes | None
    window: Window | None
    clock: Clock = "path"


class FigureWorker:
    """One worker process that makes figures and other data from samples. It starts with the first task or with :meth:`warm_up`."""

    def __init__(self) -> None:
        self._closed = False
        self.exporting = CapacityLimiter(_EXPORTS_AT_ONCE)
        """Limits the number of threads that export whole records through this worker."""
        self._pool: ProcessPoolExecutor | None = None
        self._choosing_pool = threading.Lock()
        self._warm: Future[None] | None = None

    def warm_up(self) -> None:
        """Start the worker before the first figure is requested. Call this from a worker thread."""
        self._warm = self._submit(_warm_up)

    def build(self, function: Callable[..., _Built], *parts: object) -> _Built:
        """Run a function on stored samples in the worker and wait for its result. Call this from a worker thread.

        :returns: the function's result. The figures of this module are JSON.
        :raises ProblemError: 410 when the samples cannot be read.
        """
        try:
            built = self._submit(function, *parts).result()
        except UnreadableError as error:
            raise samples_damaged() from error
        except BrokenProcessPool:
            if self._closed:
                raise
            # The worker was killed, perhaps for lack of memory. Try once more with a new worker.
            self._end_pool(wait=False)
            return self._submit(function, *parts).result()
        self._replace_if_large()
        return built

    def close(self) -> None:
        """End the worker. A worker that is still warming up is terminated."""
        with self._choosing_pool:
            self._closed = True
        if self._pool and self._warm and not self._warm.done():
            for worker in list(self._pool._processes.values()):
                worker.terminate()
        self._end_pool(wait=True)

    def _replace_if_large(self) -> None:
        """Start a new worker for the next task if this one holds much memory, for example libraries of a printed report.

        The former worker finishes the tasks that wait for it, and ends.
        """
        pool = self._pool
        # A pool that another thread has ended has no processes.
        processes = list(pool._processes or ()) if pool else []
        if any(_private_bytes(pid) > _LARGEST_WORKER_BYTES for pid in processes):
            self._end_pool(wait=False)
            # The service ends, or the computer has no memory: the next task tries again.
            with suppress(RuntimeError, OSError):
                self.warm_up()

    def _submit(self, function: Callable[..., _Built], *parts: object) -> Future[_Built]:
        """Submit a task to the worker. This starts the worker if it is not running."""
        # Ctrl-C in a terminal signals every process of the group. The service ends the worker, so the worker
        # inherits a mask for the signal.
        before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        try:
            # Another thread may replace the pool. It ends only a pool that no thread can choose any more.
            with self._choosing_pool:
                return self._usable_pool().submit(function, *parts)
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)

    def _usable_pool(self) -> ProcessPoolExecutor:
        """Return the pool. It is made when it is first needed, because it starts a process of its own beside the worker."""
        if self._closed:
            raise RuntimeError("the figure worker is closed")
        if self._pool is None:
            spawning = multiprocessing.get_context("spawn")
            self._pool = ProcessPoolExecutor(1, mp_context=spawning, initializer=_begin)
        return self._pool

    def _end_pool(self, *, wait: bool) -> None:
        with self._choosing_pool:
            pool, self._pool = self._pool, None
        if pool:
            pool.shutdown(wait=wait, cancel_futures=wait)


def _private_bytes(pid: int) -> int:
    """Return a process' memory that is neither shared nor in a file; 0 if it has ended, or if the system does not tell."""
    try:
        status = Path(f"/proc/{pid}/status").read_text()
    except OSError:
        return 0
    found = re.search(r"^RssAnon:\s+(\d+) kB", status, re.MULTILINE)
    return int(found[1]) << 10 if found else 0


def chunks(figure: str) -> Iterator[bytes]:
    """Yield a figure in chunks. Half a megabyte in one chunk would delay the event loop's heartbeats."""
    for start in range(0, len(figure), _CHUNK_CHARACTERS):
        yield figure[start : start + _CHUNK_CHARACTERS].encode()


def recording(parts: RecordingFigureSamples) -> str:
    """Return a recording's five angles over time, one plot below the other, as JSON of a Plotly figure."""
    lines = _recording_lines(parts)
    angles = [lines["taught_deg"][:, axis] for axis in range(len(AXES))]
    traces = [
        _line(
            lines["taught_s"][:, axis],
            angles[axis],
            texts.FIGURE_MOTOR(motor=motor),
            _style(INDIGO, 1.5),
            motor,
        )
        for axis, motor in enumerate(AXES)
    ]
    return _stacked(traces, angles, parts.window, legend=False)


def derived(before_series: Series, after_series: Series) -> str:
    """Return a derived recording and its original in common plots, one for each motor, as JSON of a Plotly figure."""
    before, after = _lines_with_extremes(unpack(before_series)), _lines_with_extremes(unpack(after_series))
    traces, angles = [], []
    for axis, motor in enumerate(AXES):
        old, new = before["taught_deg"][:, axis], after["taught_deg"][:, axis]
        traces += [
            _line(before["taught_s"][:, axis], old, texts.FIGURE_BEFORE(), _style(INDIGO, 1.2), motor),
            _line(after["taught_s"][:, axis], new, texts.FIGURE_AFTER(), _style(ORANGE, dash="dash"), motor),
        ]
        for trace in traces[-2:]:
            trace["showlegend"] = axis == 0
        angles.append(np.concatenate([old, new]))
    return _stacked(traces, angles, None, legend=True)


def run(parts: RunFigureSamples) -> str:
    """Return the paper's figure for each motor as JSON of ``RunFigures``: both angles on the left axis, the error on the right.

    The requested motion is the taught samples with the run's settings.
    """
    lines = run_lines(parts)
    time = texts.FIGURE_TIME_WALL() if parts.clock == "wall" else texts.FIGURE_TIME_PATH()
    figures = []
    for axis, motor in enumerate(AXES):
        of_motor = {name: values[:, axis] for name, values in lines.items()}
        error = _line(of_motor["played_s"], of_motor["error_deg"], texts.FIGURE_ERROR(), _style(PALE_GREEN, 1.2))
        traces = [
            _line(of_motor["taught_s"], of_motor["taught_deg"], texts.FIGURE_REQUESTED(), _style(INDIGO)),
            _line(
                of_motor["played_s"],
                of_motor["played_deg"],
                texts.FIGURE_PLAYBACK(),
                _style(ORANGE, dash="dash"),
            ),
            error | {"yaxis": "y2"},
        ]
        layout = _layout() | {
            "height": 340,
            "xaxis": {"title": {"text": time}} | _FIXED_MARGIN | _range(parts.window),
            "yaxis": {"title": {"text": texts.FIGURE_ANGLE()}, "range": _around(of_motor["taught_deg"])}
            | _FIXED_MARGIN,
            "yaxis2": _FIXED_MARGIN
            | {
                "title": {"text": texts.FIGURE_ERROR_DEG()},
                "overlaying": "y",
                "side": "right",
                "showgrid": False,
                "tickmode": "auto",
                "nticks": 6,
                "range": _symmetric(of_motor["error_deg"]),
            },
        }
        figures.append({"motor": motor, "figure": with_texts({"data": traces, "layout": layout})})
    return json.dumps({"motors": figures})


def _stacked(traces: list[_Trace], angles_deg: list[Floats], window: Window | None, *, legend: bool) -> str:
    """Return a figure with one row for each motor and a common time axis."""
    layout = _rows() | _layout() | {"height": 900, "showlegend": legend}
    for motor, angle_deg in zip(AXES, angles_deg, strict=True):
        layout[_axis("yaxis", motor)] |= {
            "title": {"text": texts.FIGURE_MOTOR_DEG(motor=motor)},
            "range": _around(angle_deg),
        }
        layout[_axis("xaxis", motor)] |= _range(window)
    layout[_axis("xaxis", AXES[-1])]["title"] = {"text": texts.FIGURE_TIME()}
    return json.dumps(with_texts({"data": traces, "layout": layout}))


def _rows() -> _Layout:
    """Return the layout with one row of axes for each motor, below each other."""
    height = (1.0 - (len(AXES) - 1) * _ROW_GAP) / len(AXES)
    layout: _Layout = {}
    for motor in AXES:
        bottom = (len(AXES) - motor) * (height + _ROW_GAP)
        shared = {} if motor == AXES[-1] else {"matches": f"x{AXES[-1]}", "showticklabels": False}
        layout[_axis("xaxis", motor)] = {"anchor": _axis("y", motor), "domain": [0.0, 1.0]} | shared
        layout[_axis("yaxis", motor)] = {"anchor": _axis("x", motor), "domain": [bottom, bottom + height]}
    return layout


@cache
def _layout() -> _Layout:
    """Return the common layout with Plotly's template.

    It reads the template's file, because importing Plotly to make the same layout takes 30 MB and a third of a second.
    """
    package = find_spec("plotly")
    assert package is not None and package.submodule_search_locations is not None
    folder = Path(package.submodule_search_locations[0])
    return _COMMON | {"template": json.loads((folder / _TEMPLATE).read_bytes())}


def _axis(name: str, row: int) -> str:
    return name if row == 1 else f"{name}{row}"


def _range(window: Window | None) -> _Layout:
    return {"range": list(window)} if window else {}


def _recording_lines(parts: RecordingFigureSamples) -> downsampling.Lines:
    if parts.downsampled is not None:
        return decode(parts.downsampled)
    assert parts.taught is not None
    if parts.window is None:
        return _lines_with_extremes(unpack(parts.taught))
    return _lines_with_extremes(unpack_within(parts.taught, "time_s", *parts.window))


def _lines_with_extremes(taught: dict[str, Floats]) -> downsampling.Lines:
    """Return the lines of these samples. Each section of a line keeps its lowest and highest value."""
    return downsampling.recording_lines(taught["time_s"], taught["angle_deg"])


def run_lines(parts: RunFigureSamples) -> downsampling.Lines:
    """Return the lines of a run (:func:`kata.plotting.downsampling.run_lines`).

    :raises UnreadableError: when the samples of the run or of its recording are damaged.
    """
    if parts.downsampled is not None:
        return decode(parts.downsampled)
    assert parts.taught is not None and parts.played is not None
    taught = unpack(parts.taught)
    motion = with_settings(Motion(taught["time_s"], taught["angle_deg"]), parts.asked)
    if parts.window is not None and parts.clock == "path":
        played = unpack_within(parts.played, "path_s", *parts.window)
    else:
        played = unpack(parts.played)
    clock_s = _clock_s(played, parts.clock)
    is_shown = played["phase"] == PHASE_PLAYING
    if parts.window is not None:
        is_shown &= (clock_s >= parts.window[0]) & (clock_s <= parts.window[1])
        motion = _around_window(motion, *parts.window)
    clock_s, measured_deg = clock_s[is_shown], played["measured_deg"][is_shown]
    if not len(clock_s):
        return downsampling.run_lines(motion, clock_s, measured_deg, measured_deg)
    compared = compare(motion.times_s, motion.angles_deg, clock_s - motion.times_s[0], measured_deg)
    return downsampling.run_lines(motion, clock_s, compared.played_deg, compared.error_deg)


def _clock_s(played: dict[str, Floats], clock: Clock) -> Floats:
    if clock == "path":
        return played["path_s"]
    moving = np.isin(played["phase"], (PHASE_PLAYING, PHASE_REDUCED_RANGE))
    return wall_clock_s(played["time_s"], played["path_s"], moving)


def _around_window(motion: Motion, start_s: float, end_s: float) -> Motion:
    """Return the samples of the window and the nearest samples outside, so that the line crosses the whole window."""
    first = max(int(np.searchsorted(motion.times_s, start_s)) - 2, 0)
    last = int(np.searchsorted(motion.times_s, end_s)) + 2
    return replace(motion, times_s=motion.times_s[first:last], angles_deg=motion.angles_deg[first:last])


def _style(colour: str, width: float = 2.0, dash: str = "solid") -> _Layout:
    return {"color": colour, "width": width, "dash": dash}


def _line(x_s: Floats, y_deg: Floats, name: str, style: _Layout, row: int = 1) -> _Trace:
    """Return a line on the axes of a row."""
    return {
        "type": "scatter",
        "mode": "lines",
        "x": _numbers(x_s, "f8"),
        "y": _numbers(y_deg, "f4"),
        "name": name,
        "xaxis": _axis("x", row),
        "yaxis": _axis("y", row),
        "hovertemplate": texts.FIGURE_ANGLE_HOVER(),
        "line": style,
    }


def _numbers(values: Floats, kind: str) -> _Layout:
    """Return an array as Plotly's binary encoding."""
    return {"dtype": kind, "bdata": base64.b64encode(values.astype(f"<{kind}").tobytes()).decode()}


def _around(angle_deg: Any) -> list[float]:
    """Return the range of an angle axis. It is never so narrow that single encoder counts look like movement."""
    if not len(angle_deg):
        return [-6.0, 6.0]
    low, high = float(angle_deg.min()), float(angle_deg.max())
    reach = max(6.0, 0.6 * (high - low))
    return [(low + high) / 2 - reach, (low + high) / 2 + reach]


def _symmetric(error_deg: Any) -> list[float]:
    """Return the range of an error axis, with zero in the middle. It is never so narrow that noise looks like a fault."""
    reach = max(2.0, 1.2 * float(abs(error_deg).max(initial=0.0)))
    return [-reach, reach]


def _begin() -> None:
    """Prepare the worker: low priority, and no memory for unused libraries and past tasks."""
    os.nice(_NICENESS)
    malloc.return_free_memory()
    _end_with_parent()
    delay_unused_numpy()


def _end_with_parent() -> None:
    """Make the worker end when its parent dies, because a killed service cannot end it."""
    parent = multiprocessing.parent_process()
    assert parent is not None

    def watch() -> None:
        parent.join()
        os._exit(1)

    threading.Thread(target=watch, name="parent", daemon=True).start()


def _warm_up() -> None:
    """Start the process and read the template before the first figure is requested."""
    _layout()


def samples_damaged() -> ProblemError:
    """Return the problem of a run whose stored samples cannot be read."""
    return ProblemError(410, "unreadable_samples", texts.RUN_SAMPLES_DAMAGED(), texts.RESTORE_FROM_BACKUP())
