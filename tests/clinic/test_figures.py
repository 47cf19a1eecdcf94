"""Figures of a long motion: few points, every peak, and every sample of a window."""

import base64
import json
import os
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pytest

from kata.clinic.recordings.tables import RECORDING_COLUMNS
from kata.clinic.sessions.tables import RUN_COLUMNS
from kata.database.arrays import Floats, UnreadableError
from kata.database.series import Series, pack
from kata.device.journal import PHASE_APPROACHING, PHASE_PLAYING
from kata.motion.edit import AS_TAUGHT, Motion
from kata.motion.tracking import compare
from kata.plotting import downsampling, figures
from kata.plotting.figures import RecordingFigureSamples, RunFigureSamples, Window
from tests.support.paths import ROOT
from tests.support.processes import is_running

COUNT = 30_000
TIMES_S: Floats = np.linspace(0.0, (COUNT - 1) / 100, COUNT)
ANGLES_DEG: Floats = 30 * np.sin(TIMES_S[:, None] / 4 * np.arange(1.0, 6.0))
PEAK_AT, PEAK_DEG = 20_123, 7.5
APPROACH = 500


def played_deg() -> Floats:
    """Half a degree more than was taught, and one cycle far off."""
    angles = ANGLES_DEG + 0.5
    angles[PEAK_AT, 2] += PEAK_DEG - 0.5
    return angles


def run_parts(window: Window | None = None) -> RunFigureSamples:
    """Samples of a run: an approach and a playback."""
    approach = np.zeros((APPROACH, 5))
    measured = np.vstack([approach, played_deg()])
    columns = {
        "time_s": np.arange(APPROACH + COUNT) * 0.01,
        "phase": np.repeat([PHASE_APPROACHING, PHASE_PLAYING], [APPROACH, COUNT]),
        "path_s": np.concatenate([np.full(APPROACH, np.nan), TIMES_S]),
        "setpoint_deg": measured,
        "measured_deg": measured,
        "torque_nm": np.zeros_like(measured),
    }
    taught = pack({"time_s": TIMES_S, "angle_deg": ANGLES_DEG}, RECORDING_COLUMNS)
    return RunFigureSamples(taught, pack(columns, RUN_COLUMNS), AS_TAUGHT, None, window)


def kept_overview() -> RunFigureSamples:
    compared = compare(TIMES_S, ANGLES_DEG, TIMES_S, played_deg())
    return RunFigureSamples(None, None, AS_TAUGHT, downsampling.of_run(Motion(TIMES_S, ANGLES_DEG), compared), None)


def numbers(encoded: dict[str, str]) -> Floats:
    return np.frombuffer(base64.b64decode(encoded["bdata"]), dtype=encoded["dtype"]).astype(np.float64)


def lines(figure: dict[str, Any]) -> dict[str, tuple[Floats, Floats]]:
    return {trace["name"]: (numbers(trace["x"]), numbers(trace["y"])) for trace in figure["data"]}


@pytest.mark.parametrize("parts", [run_parts(), kept_overview()], ids=["samples", "overview"])
def test_long_run_is_plotted_with_few_points_and_every_peak(parts: RunFigureSamples) -> None:
    motors = json.loads(figures.run(parts))["motors"]
    third = lines(motors[2]["figure"])
    for x, y in third.values():
        assert len(x) == len(y) <= 2 * downsampling.LINE_POINTS
        assert (np.diff(x) >= 0).all()
        assert (x[0], x[-1]) == (0.0, pytest.approx(TIMES_S[-1]))
    at, error = third["Error"]
    peak = int(np.argmax(error))
    assert (at[peak], error[peak]) == (pytest.approx(TIMES_S[PEAK_AT], abs=1e-3), pytest.approx(PEAK_DEG, abs=2e-3))
    assert lines(motors[1]["figure"])["Error"][1] == pytest.approx(0.5, abs=2e-3)
    assert third["Requested"][1].max() == pytest.approx(ANGLES_DEG[:, 2].max(), abs=1e-3)
    assert motors[2]["figure"]["layout"]["yaxis2"]["range"][1] > PEAK_DEG


def test_overview_is_much_smaller_than_its_samples() -> None:
    parts, whole = kept_overview(), run_parts()
    assert parts.downsampled is not None and whole.played is not None
    assert len(parts.downsampled) < 80_000


def test_window_of_a_run_shows_every_sample_inside() -> None:
    window = (200.0, 203.0)
    third = json.loads(figures.run(run_parts(window)))["motors"][2]["figure"]
    assert third["layout"]["xaxis"]["range"] == [200.0, 203.0]
    x, error = lines(third)["Error"]
    within = (TIMES_S >= 200.0) & (TIMES_S <= 203.0)
    assert x == pytest.approx(TIMES_S[within])
    assert error == pytest.approx((played_deg() - ANGLES_DEG)[within, 2], abs=2e-3)
    taught_s, _ = lines(third)["Requested"]
    assert taught_s[0] <= 200.0 and taught_s[-1] >= 203.0 and len(taught_s) < 310


def test_unplayed_window_shows_the_taught_motion() -> None:
    parts = run_parts((1000.0, 1001.0))
    figure = json.loads(figures.run(parts))["motors"][0]["figure"]
    assert len(lines(figure)["Error"][0]) == 0
    early = replace(parts, played=pack({name: np.empty((0, 5) if name.endswith(("deg", "nm")) else 0) for name in (
        "time_s", "phase", "path_s", "setpoint_deg", "measured_deg", "torque_nm"
    )}, RUN_COLUMNS), window=(1.0, 2.0))  # fmt: skip
    assert len(lines(json.loads(figures.run(early))["motors"][0]["figure"])["Requested"][0]) > 100


def test_window_plots_although_another_minute_is_damaged() -> None:
    parts = run_parts((200.0, 203.0))
    assert parts.played is not None
    hurt = replace(parts, played=Series(parts.played.head, dict(parts.played.blocks) | {0: b"damaged"}))
    assert figures.run(hurt) == figures.run(parts)
    with pytest.raises(UnreadableError):
        figures.run(replace(hurt, window=(10.0, 11.0)))


def test_recording_plots_from_its_overview_and_zooms_into_samples() -> None:
    taught = pack({"time_s": TIMES_S, "angle_deg": ANGLES_DEG}, RECORDING_COLUMNS)
    seen = downsampling.of_recording(TIMES_S, ANGLES_DEG)
    for parts in (RecordingFigureSamples(taught, None, None), RecordingFigureSamples(None, seen, None)):
        x, y = lines(json.loads(figures.recording(parts)))["Motor 5"]
        assert len(x) == downsampling.LINE_POINTS
        assert (y.min(), y.max()) == pytest.approx((ANGLES_DEG[:, 4].min(), ANGLES_DEG[:, 4].max()), abs=1e-3)
    closer = json.loads(figures.recording(RecordingFigureSamples(taught, None, (100.0, 101.0))))
    assert len(lines(closer)["Motor 1"][0]) == pytest.approx(101, abs=1)
    assert closer["layout"]["xaxis5"]["range"] == [100.0, 101.0]


def test_short_run_is_saved_without_an_overview() -> None:
    assert downsampling.of_recording(TIMES_S[:6000], ANGLES_DEG[:6000]) is None
    compared = compare(TIMES_S, ANGLES_DEG, TIMES_S[:6000], ANGLES_DEG[:6000])
    assert downsampling.of_run(Motion(TIMES_S, ANGLES_DEG), compared) is None


def test_plotly_accepts_the_handmade_figures() -> None:
    """Plotly checks every name and value of a figure that it reads as JSON."""
    # The import takes a second, which each worker would spend when it collects the tests.
    import plotly.graph_objects as go

    taught = pack({"time_s": TIMES_S, "angle_deg": ANGLES_DEG}, RECORDING_COLUMNS)
    made = [
        json.loads(figures.recording(RecordingFigureSamples(taught, None, None))),
        json.loads(figures.derived(taught, taught)),
    ]
    made += [motor["figure"] for motor in json.loads(figures.run(run_parts((1.0, 2.0))))["motors"]]
    for figure in made:
        assert figure.pop("texts")
        assert len(go.Figure(figure).data) == len(figure["data"])


def test_handmade_layout_is_plotlys() -> None:
    """Kata makes the rows and reads the template without importing Plotly. The result is what Plotly makes."""
    import plotly.graph_objects as go
    from plotly.subplots import make_subplots

    made = json.loads(
        figures.recording(RecordingFigureSamples(None, downsampling.of_recording(TIMES_S, ANGLES_DEG), None))
    )
    layout = go.Figure(layout={"template": "plotly_white"}).to_plotly_json()["layout"]
    assert made["layout"]["template"] == layout["template"]
    rows = make_subplots(rows=5, cols=1, shared_xaxes=True, vertical_spacing=0.03).to_plotly_json()["layout"]
    for name in set(rows) - {"template"}:
        expected = rows[name]
        assert made["layout"][name]["domain"] == pytest.approx(expected.pop("domain"))
        assert made["layout"][name].items() >= expected.items()


@pytest.mark.campaign
def test_worker_takes_no_memory_for_unused_libraries() -> None:
    """A worker that has drawn a figure and compared a playback has imported none of them. Together they would take 60 MB."""
    worker = figures.FigureWorker()
    try:
        worker.build(
            figures.recording, RecordingFigureSamples(None, downsampling.of_recording(TIMES_S, ANGLES_DEG), None)
        )
        worker.build(compare, TIMES_S, ANGLES_DEG, TIMES_S, played_deg())
        imported = worker.build(eval, "set(__import__('sys').modules)")
    finally:
        worker.close()
    assert "numpy" in imported
    unused = {"plotly", "scipy.interpolate", "scipy.optimize", "scipy.signal", "unittest", "charset_normalizer"}
    assert imported & unused == set()


def test_a_large_worker_is_replaced_after_its_tasks() -> None:
    """A report's fonts or an export's libraries would stay until the service ends."""
    hold = "setattr(__import__('builtins'), 'held', b'x' * (64 << 20)) or __import__('os').getpid()"
    worker = figures.FigureWorker()
    try:
        first = worker.build(os.getpid)
        assert worker.build(os.getpid) == first
        with ThreadPoolExecutor() as threads:
            tasks = [threads.submit(worker.build, eval, hold)]
            tasks += [threads.submit(worker.build, max, 1, 2) for _ in range(8)]
            assert [task.result() for task in tasks] == [first, *[2] * 8]
        assert worker.build(os.getpid) != first
    finally:
        worker.close()


def test_everyday_tasks_do_not_cost_the_worker() -> None:
    """A new worker would take two seconds for the libraries of each of these tasks."""
    worker = figures.FigureWorker()
    try:
        first = worker.build(os.getpid)
        for module in (
            "kata.clinic.programmes.checks",
            "kata.clinic.recordings.derive",
            "kata.clinic.rhythm.service",
            "kata.clinic.sessions.run_results",
            "kata.interop.motion_csv",
        ):
            worker.build(exec, f"import {module}")
            assert worker.build(os.getpid) == first, module
    finally:
        worker.close()


class ThreadInsteadOfProcess(ThreadPoolExecutor):
    """Starts in microseconds, so that thousands of workers can be replaced."""

    def __init__(self, workers: int, **_: object) -> None:
        super().__init__(workers)
        self._processes: dict[int, None] | None = {os.getpid(): None}

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        super().shutdown(wait, cancel_futures=cancel_futures)
        self._processes = None


def test_no_task_is_lost_while_workers_are_replaced(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every worker is replaced after its first task, while other threads submit theirs."""
    monkeypatch.setattr(figures, "ProcessPoolExecutor", ThreadInsteadOfProcess)
    monkeypatch.setattr(figures, "_LARGEST_WORKER_BYTES", 0)
    worker = figures.FigureWorker()
    try:
        with ThreadPoolExecutor(8) as threads:
            assert list(threads.map(partial(worker.build, max, 1), range(1000))) == [1, 1, *range(2, 1000)]
    finally:
        worker.close()


def test_pool_that_another_thread_has_ended_is_left_alone() -> None:
    worker = figures.FigureWorker()
    assert worker.build(max, 1, 2) == 2
    assert worker._pool is not None
    worker._pool.shutdown()
    worker._replace_if_large()
    worker.close()


def test_closing_does_not_wait_for_a_worker_warming_up(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(figures, "_warm_up", partial(time.sleep, 600))
    worker = figures.FigureWorker()
    worker.warm_up()
    ending = threading.Thread(target=worker.close, daemon=True)
    ending.start()
    ending.join(20)
    assert not ending.is_alive()


def test_a_worker_without_a_task_starts_no_process() -> None:
    program = """
import os
from kata.plotting.figures import FigureWorker
from tests.support.processes import descendants

worker = FigureWorker()
print(descendants(os.getpid()))
worker.close()
"""
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, check=True, timeout=60
    )
    assert done.stdout.strip() == "set()"


def test_a_closed_worker_starts_no_process() -> None:
    worker = figures.FigureWorker()
    worker.close()
    with pytest.raises(RuntimeError, match="closed"):
        worker.warm_up()


def test_a_worker_ends_with_a_killed_service() -> None:
    program = """
import os, signal
from kata.plotting.figures import FigureWorker
from tests.support.processes import descendants

if __name__ == "__main__":
    worker = FigureWorker()
    worker.build(max, 1, 2)
    print(*descendants(os.getpid()), flush=True)
    signal.pause()
"""
    with subprocess.Popen([sys.executable, "-c", program], cwd=ROOT, stdout=subprocess.PIPE, text=True) as service:
        try:
            assert service.stdout is not None
            started = [int(word) for word in service.stdout.readline().split()]
        finally:
            service.kill()
    assert len(started) == 2  # worker and multiprocessing's resource tracker
    limit = time.monotonic() + 20
    while any(is_running(pid) for pid in started):
        assert time.monotonic() < limit, started
        time.sleep(0.05)
