"""Plotly figures, built in a worker process: a long plot must not keep the service from its heartbeats."""

import json
import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from typing import Any, Final

import plotly.graph_objects as go
from plotly.subplots import make_subplots

from kata.clinic.problems import ProblemError
from kata.database.arrays import UnreadableError, decode
from kata.device.journal import PHASE_PLAYING
from kata.motion.axes import AXES
from kata.motion.tracking import compare

# Red, yellow and cyan are kept for alarms. These are told apart by everybody, and in grey by their brightness.
_TAUGHT: Final = "#1f3a93"
_PLAYED: Final = "#e07b00"
_ERROR: Final = "#5e9c76"
_PIECE: Final = 1 << 18
_NICENESS: Final = 10
"""Whoever waits for a plot waits; the service and its heartbeats go first."""
_LAYOUT: Final = {
    "template": "plotly_white",
    "margin": {"l": 60, "r": 60, "t": 30, "b": 45},
    "legend": {"orientation": "h", "y": 1.02, "yanchor": "bottom", "x": 0},
    "hovermode": "x unified",
    "font": {"family": "system-ui, sans-serif", "size": 13},
}


class FigureWorker:
    """One process of its own that turns samples into figures."""

    def __init__(self) -> None:
        self._pool = self._new_pool()

    def build(self, figure: Callable[..., str], *blobs: bytes) -> str:
        """Run one of this module's figures on stored samples; waits for it, so call it from a worker thread.

        :returns: JSON.
        :raises ProblemError: 410 when the samples cannot be read.
        """
        try:
            return self._pool.submit(figure, *blobs).result()
        except UnreadableError as error:
            raise ProblemError(
                410,
                "unreadable_samples",
                "The samples are damaged and cannot be drawn.",
                "Restore them from a backup.",
            ) from error
        except BrokenProcessPool:
            # The worker was killed, for want of memory perhaps. Once more, with a new one.
            self._pool.shutdown(wait=False)
            self._pool = self._new_pool()
            return self._pool.submit(figure, *blobs).result()

    def close(self) -> None:
        """End the worker."""
        self._pool.shutdown(wait=True, cancel_futures=True)

    @staticmethod
    def _new_pool() -> ProcessPoolExecutor:
        spawning = multiprocessing.get_context("spawn")
        pool = ProcessPoolExecutor(1, mp_context=spawning, initializer=_end_with_parent)
        # Ctrl-C in a terminal reaches every process of the group; ending the worker is ours. It inherits the mask.
        before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        try:
            pool.submit(_warm_up)
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)
        return pool


def pieces(figure: str) -> Iterator[bytes]:
    """A figure as it goes out. In one piece, an hour's hundred megabytes would keep the event loop from its heartbeats."""
    for start in range(0, len(figure), _PIECE):
        yield figure[start : start + _PIECE].encode()


def recording(taught_blob: bytes) -> str:
    """A recording's five angles over time, one under the other, as JSON of a Plotly figure."""
    taught = decode(taught_blob)
    figure = make_subplots(rows=len(AXES), cols=1, shared_xaxes=True, vertical_spacing=0.03)
    for motor in AXES:
        line = go.Scatter(
            x=taught["time_s"],
            y=taught["angle_deg"][:, motor - 1],
            name=f"Motor {motor}",
            line={"color": _TAUGHT, "width": 1.5},
        )
        figure.add_trace(line, row=motor, col=1)
        angles = _around(taught["angle_deg"][:, motor - 1])
        figure.update_yaxes(title_text=f"Motor {motor}, deg", range=angles, row=motor, col=1)
    figure.update_xaxes(title_text="Time, s", row=len(AXES), col=1)
    figure.update_layout(**_LAYOUT, showlegend=False, height=900)
    return str(figure.to_json())


def run(taught_blob: bytes, run_blob: bytes) -> str:
    """The paper's figure for each motor, as JSON of ``RunFigures``: both angles on the left axis, the error on the right."""
    taught, played = decode(taught_blob), decode(run_blob)
    playing = played["phase"] == PHASE_PLAYING
    compared = compare(
        taught["time_s"], taught["angle_deg"], played["path_s"][playing], played["measured_deg"][playing]
    )
    figures = []
    for axis, motor in enumerate(AXES):
        figure = go.Figure(
            [
                _line(taught["time_s"], taught["angle_deg"][:, axis], "Teaching", _TAUGHT),
                _line(compared.times_s, compared.played_deg[:, axis], "Playback", _PLAYED, dash="dash"),
                _line(compared.times_s, compared.error_deg[:, axis], "Error", _ERROR, yaxis="y2", width=1.2),
            ]
        )
        figure.update_layout(
            **_LAYOUT,
            height=340,
            xaxis={"title": {"text": "Time, s"}},
            yaxis={"title": {"text": "Angle, deg"}, "range": _around(taught["angle_deg"][:, axis])},
            yaxis2={
                "title": {"text": "Error, deg"},
                "overlaying": "y",
                "side": "right",
                "showgrid": False,
                "tickmode": "auto",
                "nticks": 6,
                "range": _symmetric(compared.error_deg[:, axis]),
            },
        )
        figures.append({"motor": motor, "figure": json.loads(str(figure.to_json()))})
    return json.dumps({"motors": figures})


def _line(
    x: Any, y: Any, name: str, colour: str, *, dash: str = "solid", width: float = 2.0, yaxis: str = "y"
) -> go.Scatter:
    unit = "%{y:.2f} deg"
    return go.Scatter(
        x=x, y=y, name=name, yaxis=yaxis, hovertemplate=unit, line={"color": colour, "width": width, "dash": dash}
    )


def _around(angle_deg: Any) -> list[float]:
    """An angle axis that holds it all, never so narrow that single counts of the encoder look like movement."""
    low, high = float(angle_deg.min()), float(angle_deg.max())
    reach = max(6.0, 0.6 * (high - low))
    return [(low + high) / 2 - reach, (low + high) / 2 + reach]


def _symmetric(error_deg: Any) -> list[float]:
    """An error axis with zero in the middle, never so narrow that noise looks like a fault."""
    reach = max(2.0, 1.2 * float(abs(error_deg).max()))
    return [-reach, reach]


def _end_with_parent() -> None:
    """A service that is killed cannot end its worker; so the worker watches."""
    os.nice(_NICENESS)
    parent = multiprocessing.parent_process()
    assert parent is not None

    def watch() -> None:
        parent.join()
        os._exit(1)

    threading.Thread(target=watch, name="parent", daemon=True).start()


def _warm_up() -> None:
    """Plotly takes a second to import; better now than at the first plot."""
