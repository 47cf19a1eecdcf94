"""``kata commission --lines``: the commissioning procedure of :mod:`kata.commissioning` for a program. The service runs it for its page.

Each line of standard output is a JSON object with ``event``: ``step``, ``instruct``, ``working``, ``ended`` or ``finished``. Each line of
standard input is ``{"confirm": NUMBER}`` with the number of an instruction, or ``{"stop": true}``, with ``"browser_lost": true`` if the
page is gone. The end of standard input means a stop. After a first ``{"beat": true}`` a silence of two seconds means a stop, too.
The confirmation of an instruction with a review of gains also has ``choice``, a :class:`~kata.commissioning.gains_review.GainsChoice`.
"""

import json
import os
import select
import sys
import time
from collections.abc import Callable
from typing import Any, Final

import msgspec

from kata.commissioning import texts
from kata.commissioning.gains_review import GainsChoice
from kata.commissioning.procedure import CommissioningStep
from kata.commissioning.record import RecordedStep
from kata.commissioning.workbench import ManualAction, StepError, Technician
from kata.device import texts as device_texts
from kata.messages import Text

_SILENCE_S: Final = 2.0
"""Longest silence of a service that sends heartbeats. One that hangs cannot pass on a Stop. A playback pauses after the same time without
its operator's browser.
"""


class LineTechnician:
    """Sends instructions as lines, and reads confirmations and stops.

    If ``hands`` is set, they carry out an instruction after its confirmation. Nothing moves before, because the simulation's clock must not
    run while a person reads.
    """

    def __init__(self, keyboard: int | None = None) -> None:
        """``keyboard``: file descriptor of the input; standard input by default."""
        self._keyboard = sys.stdin.fileno() if keyboard is None else keyboard
        self._unread = b""
        self._number = 0
        self._confirmed = 0
        self._choice = GainsChoice("keep")
        self._stopped: Text | None = None
        self._beat_s: float | None = None
        """Time of the last heartbeat; None before the first."""
        self._instruction: ManualAction | None = None
        self.hands: Technician | None = None

    def instruct(self, instruction: ManualAction) -> None:
        """See :class:`~kata.commissioning.workbench.Technician`."""
        self._number += 1
        self._instruction = instruction
        send(
            event="instruct",
            number=self._number,
            kind=instruction.kind,
            text=str(instruction.text),
            text_key=msgspec.to_builtins(instruction.text.key),
            motor=instruction.number,
            seen=instruction.seen,
            press=self.hands is not None or not instruction.seen,
            review=msgspec.to_builtins(instruction.review),
        )

    def has_confirmed(self) -> bool:
        """See :class:`~kata.commissioning.workbench.Technician`."""
        if self.hands is None:
            self._read(0.0)
            self._raise_if_stopped()
            return self._take_confirmation()
        if self._instruction is not None:
            while not self._take_confirmation():
                self._read(None)
                self._raise_if_stopped()
            self.hands.instruct(self._instruction)
            self._instruction = None
        return self.hands.has_confirmed()

    def gains_choice(self) -> GainsChoice:
        """See :class:`~kata.commissioning.workbench.Technician`."""
        return self._choice

    def stoppable(self, sleep: Callable[[float], None]) -> Callable[[float], None]:
        """Return a function that sleeps like ``sleep`` and raises StepError after a stop. Every wait and every cycle of the steps calls
        it.
        """

        def sleep_unless_stopped(seconds: float) -> None:
            self._read(0.0)
            self._raise_if_stopped()
            sleep(seconds)

        return sleep_unless_stopped

    def _take_confirmation(self) -> bool:
        if self._confirmed != self._number:
            return False
        self._confirmed = 0
        send(event="working")
        return True

    def _raise_if_stopped(self) -> None:
        if self._stopped is None and self._beat_s is not None and time.monotonic() - self._beat_s > _SILENCE_S:
            self._stopped = device_texts.SERVICE_SILENT()
        if self._stopped is not None:
            raise StepError(self._stopped)

    def _read(self, timeout_s: float | None) -> None:
        """Read the lines that have been sent. If ``timeout_s`` is None, wait for input."""
        while select.select([self._keyboard], [], [], timeout_s)[0]:
            data = os.read(self._keyboard, 4096)
            if not data:
                self._stopped = texts.TECHNICIAN_STOPPED()
                return
            *lines, self._unread = (self._unread + data).split(b"\n")
            for line in lines:
                message = json.loads(line)
                if message.get("beat"):
                    self._beat_s = time.monotonic()
                if message.get("stop"):
                    self._stopped = (
                        device_texts.BROWSER_LOST() if message.get("browser_lost") else texts.TECHNICIAN_STOPPED()
                    )
                self._confirmed = message.get("confirm", self._confirmed)
                if choice := message.get("choice"):
                    self._choice = msgspec.convert(choice, GainsChoice)
            timeout_s = 0.0


class LineFrontEnd:
    """Sends the progress of the procedure as lines."""

    def announce(self, step: CommissioningStep) -> None:
        """See :class:`~kata.cli.commission.FrontEnd`."""
        send(event="step", step=step.key)

    def report(self, ran: RecordedStep) -> None:
        """See :class:`~kata.cli.commission.FrontEnd`."""
        send(event="ended", run=msgspec.to_builtins(ran))

    def finish(self, *, passed: bool, text: str) -> None:
        """See :class:`~kata.cli.commission.FrontEnd`."""
        send(event="finished", passed=passed, text=text)


def send(**message: Any) -> None:
    """Write a line."""
    sys.stdout.write(json.dumps(message) + "\n")
    sys.stdout.flush()
