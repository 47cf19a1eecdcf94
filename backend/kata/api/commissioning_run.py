"""Run the commissioning procedure for the page. It runs in a separate process, which uses the drives in place of the device process."""

import asyncio
import contextlib
import json
import logging
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final, Literal

import msgspec

from kata.api import texts
from kata.commissioning.gains_review import GainsChoice, GainsReview
from kata.commissioning.record import writing_problem
from kata.commissioning.steps import STEPS_WITH_TORQUE
from kata.device import config
from kata.device.config import StationConfig
from kata.device.ipc_messages import Refusal
from kata.station.guard import Guard
from kata.station.lease import PAUSE_AFTER_ABSENCE_S, STOP_AND_END_LEASE_AFTER_S, Browser
from kata.station.station import NO_ANSWER, Station

log = logging.getLogger(__name__)

PRACTICE_FILE: Final = "practice.toml"
"""File in the data folder to which a practice run on a simulated apparatus writes its configuration."""
_STOP_LIMIT_S: Final = 1.5
"""The procedure ends within a 10 ms cycle after a stop. A process that still runs after this time is killed; the drives' watchdog then
stops them.
"""
_END_LIMIT_S: Final = 10.0
_LONGEST_LINE: Final = 1 << 20
_LOOK_S: Final = 0.25
"""Time between two checks that the browser is present, and between two heartbeats."""

RunKind = Literal["full", "check"]


@dataclass
class RunProgress:
    """Progress of the procedure, as reported so far."""

    kind: RunKind
    by: str
    simulated: bool
    before: set[str] = field(default_factory=set)
    """Keys of the steps that had passed before this run."""
    running: bool = True
    step: str = ""
    """Key of the step that is running or, if none is, that ran last."""
    instruction: dict[str, Any] | None = None
    """The present instruction to the technician."""
    ended: list[dict[str, Any]] = field(default_factory=list)
    """Finished steps, in the form of the commissioning record."""
    passed: bool | None = None
    presses: int = 0
    numbers_before: int = 0
    """Largest number of an instruction of earlier runs. The procedure itself counts from 1. A delayed confirmation of an earlier run so has no
    effect.
    """


class CommissioningRun:
    """Runs at most one procedure. Use it in the service's event loop only."""

    def __init__(
        self,
        station: Station,
        station_file: Path | None,
        data: Path,
        on_passed: Callable[[StationConfig, str], None],
        on_browser_lost: Callable[[Browser], None],
    ) -> None:
        """``station_file``: file of the real apparatus; a simulated one practises in ``data``. ``on_passed`` gets the new configuration
        and the name of the user who started the run. ``on_browser_lost`` is called when a run is stopped because its browser is absent.
        """
        self._station, self._station_file, self._data = station, station_file, data
        self._on_passed, self._on_browser_lost = on_passed, on_browser_lost
        self._browser: Browser | None = None
        """The browser that started the run, or gave the last confirmation."""
        self._seen_s = 0.0
        self._child: asyncio.subprocess.Process | None = None
        self._following: asyncio.Task[None] | None = None
        self._watching: asyncio.Task[None] | None = None
        self._newest_number = 0
        """Number of the newest instruction of all runs."""
        self._stopped = False
        """True from a Stop until the end of the run. A second start, which is refused, does not change it."""
        self.progress: RunProgress | None = None

    @property
    def file(self) -> Path | None:
        """Return the station's file that a run would write."""
        return self._data / PRACTICE_FILE if self.practises else self._station_file

    @property
    def running(self) -> bool:
        """True while a procedure runs."""
        return self.progress is not None and self.progress.running

    @property
    def practises(self) -> bool:
        """True if a run is a practice on a simulated apparatus."""
        return self._station.info.simulated

    async def start(
        self, kind: RunKind, begin: str | None, browser: Browser, before: set[str], guard: Guard
    ) -> Refusal | None:
        """Take the drives from the device process and start the procedure. Return None when it runs.

        :param before: steps that have passed before this run.
        :param guard: a stop that the browser has not seen, and its expiry, refuse the start.
        """
        file, simulated = self.file, self.practises
        if file is None:
            return Refusal.of(
                code="no_station_file", message=texts.NO_STATION_FILE(), next_step=texts.START_WITH_STATION_FILE()
            )
        if problem := writing_problem(file):
            return Refusal.of(
                code="station_file_not_written",
                message=texts.STATION_FILE_NOT_WRITTEN(reason=problem),
                next_step=texts.ALLOW_WRITING_STATION_FILE(),
            )
        if refusal := await self._station.hand_over(self.stop, guard):
            return refusal
        self.progress = RunProgress(kind, browser.name, simulated, before, numbers_before=self._newest_number)
        self._operate(browser)
        options = [f"--by={browser.name}", "--lines"]
        options += ["--simulate=1"] if simulated else []
        options += ["--check"] if kind == "check" else []
        options += [f"--from={begin}"] if begin else []
        try:
            self._child = await asyncio.create_subprocess_exec(
                *(sys.executable, "-m", "kata", "commission", str(file), *options),
                stdin=asyncio.subprocess.PIPE,
                stdout=asyncio.subprocess.PIPE,
                limit=_LONGEST_LINE,
                start_new_session=True,
            )
        except OSError:
            log.exception("the commissioning process cannot be started")
            self._end(None)
            return Refusal.of(
                code=NO_ANSWER, message=texts.COMMISSIONING_NOT_STARTED(), next_step=texts.REPORT_WITH_LOG()
            )
        if self._stopped:  # while the drives were handed over
            self._send({"stop": True})
        self._following = asyncio.create_task(self._follow(self._child, file), name="commissioning")
        self._watching = asyncio.create_task(self._stop_without_browser(), name="commissioning browser")
        return None

    def shows(self, number: int) -> bool:
        """Return True if the instruction with this number is shown."""
        instruction = self.progress.instruction if self.progress else None
        return instruction is not None and instruction["number"] == number

    def accepts(self, choice: dict[str, Any]) -> bool:
        """Return True if the present instruction is a review of gains that accepts this choice."""
        instruction = self.progress.instruction if self.progress else None
        if instruction is None or instruction["review"] is None:
            return False
        review = msgspec.convert(instruction["review"], GainsReview)
        return review.accepts(msgspec.convert(choice, GainsChoice))

    def note_request(self, browser: Browser) -> None:
        """Note a request of the browser, which shows that it is present now."""
        if browser == self._browser:
            self._seen_s = time.monotonic()

    def confirm(self, number: int, browser: Browser, choice: dict[str, Any] | None = None) -> bool:
        """Confirm the instruction with this number. Return False if another one, or none, is shown, or if it needs no confirmation any more.

        :param browser: it operates the run from now on.
        :param choice: accepted answer to a review of gains.
        """
        progress = self.progress
        if (
            progress is None
            or progress.instruction is None
            or not self.shows(number)
            or not progress.instruction["press"]
        ):
            return False
        self._operate(browser)
        progress.presses += 1
        progress.instruction = progress.instruction | {"press": False}
        self._send({"confirm": number - progress.numbers_before, "choice": choice or {"action": "keep"}})
        return True

    async def stop(self, *, browser_lost: bool = False) -> Refusal | None:
        """Switch torque off and end the procedure. Return None when its process has ended."""
        self._stopped = True
        child = self._child
        if child is None:
            return None
        self._send({"stop": True, "browser_lost": browser_lost})
        try:
            async with asyncio.timeout(_STOP_LIMIT_S):
                await child.wait()
        except TimeoutError:
            log.error("the commissioning process does not stop and is killed; the drives' watchdog stops them")
            with contextlib.suppress(ProcessLookupError):
                child.kill()
            await child.wait()
        return None

    async def close(self) -> None:
        """Stop the procedure and wait for its end."""
        await self.stop()
        if self._watching:
            self._watching.cancel()
        if self._following:
            with contextlib.suppress(asyncio.CancelledError, TimeoutError):
                async with asyncio.timeout(_END_LIMIT_S):
                    await self._following

    def _operate(self, browser: Browser) -> None:
        self._browser, self._seen_s = browser, time.monotonic()

    async def _stop_without_browser(self) -> None:
        """Stop the run when its browser is absent while motors have torque: after 2 s while they work, and after 30 s while an instruction is
        shown, because the user then works at the apparatus. Send heartbeats: without them the process stops the motors.
        """
        while self.progress is not None and self.running:
            await asyncio.sleep(_LOOK_S)
            self._send({"beat": True})
            browser = self._browser
            assert browser is not None
            if self._station.lease_manager.shows(browser):
                self.note_request(browser)
            longest_s = STOP_AND_END_LEASE_AFTER_S if self.progress.instruction else PAUSE_AFTER_ABSENCE_S
            if self.progress.step in STEPS_WITH_TORQUE and time.monotonic() - self._seen_s > longest_s:
                log.warning("the browser of the commissioning (login session %s) is disconnected", browser.id)
                await self.stop(browser_lost=True)
                self._on_browser_lost(browser)
                return

    def _send(self, message: dict[str, Any]) -> None:
        if self._child is not None and self._child.stdin is not None:
            with contextlib.suppress(ConnectionError):
                self._child.stdin.write(json.dumps(message).encode() + b"\n")

    async def _follow(self, child: asyncio.subprocess.Process, file: Path) -> None:
        """Read the messages of the process until it ends, then return the drives to the control process."""
        assert child.stdout is not None and self.progress is not None
        try:
            async for line in child.stdout:
                self._take(self.progress, line)
        except ValueError:
            log.exception("a line of the commissioning process cannot be read")
            with contextlib.suppress(ProcessLookupError):
                child.kill()
        await child.wait()
        new = None
        if self.progress.passed and self.progress.kind == "full" and not self.progress.simulated:
            try:
                new = config.read(file)
            except config.ConfigError:
                log.exception("the configuration of the commissioning cannot be used")
        self._end(new)

    def _take(self, progress: RunProgress, line: bytes) -> None:
        try:
            message = json.loads(line)
        except ValueError:
            log.warning("commissioning: %s", line.decode(errors="replace").strip())
            return
        match message.pop("event", None):
            case "step":
                progress.step, progress.instruction = message["step"], None
            case "instruct":
                self._newest_number = progress.numbers_before + message["number"]
                progress.instruction = message | {"number": self._newest_number}
            case "working":
                progress.instruction = None
            case "ended":
                progress.instruction = None
                progress.ended.append(message["run"])
            case "finished":
                progress.passed = message["passed"]

    def _end(self, new: StationConfig | None) -> None:
        """Give the drives back to the device process."""
        assert self.progress is not None
        self._child = None
        self._stopped = False
        self.progress.running = False
        self.progress.instruction = None
        self.progress.passed = bool(self.progress.passed)
        if new is not None:
            self._on_passed(new, self.progress.by)
        self._station.take_back(new)
