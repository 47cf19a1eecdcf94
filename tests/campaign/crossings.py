"""Random crossings on the way from the service to the control thread, through the real exchange and its threads.

The disk keeps a write or a sync waiting, and a recording is being checked, for as long as the sequence says, which may be for ever. A
Stop passes them all the same. Nothing here depends on how fast the computer is: what waits, waits until a rule lets it go.
"""

import tempfile
import threading
from pathlib import Path
from typing import Any, Final
from unittest import mock

import msgspec
import numpy as np
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule

from kata.device import references
from kata.device.journal import JournalDisk, JournalEnd, JournalWriter
from kata.device.messages import (
    Approach,
    Command,
    Load,
    Pause,
    Play,
    Reply,
    Return,
    Stop,
    Teach,
    Unload,
    parts_of,
)
from kata.device.refusals import not_in_this_mode
from tests.support.ipc_service import Service, a_reference, until
from tests.support.journals import HEADER, give
from tests.support.load_messages import TIMES_S, angles, message
from tests.support.stepped import Stepped

_HUGE: Final = message(angles(motor1=np.where(TIMES_S > 1, 1e308, -1e308)))
"""Angles at the end of the float range."""
_REFERENCE: Final = a_reference()
_STARTS: Final[tuple[Command, ...]] = (Approach(), Play(), Return(), Pause(), Unload(), Teach(teaching_id="t"))


class _Disk(JournalDisk):
    """Takes a write, and a sync, when it may."""

    def __init__(self) -> None:
        self.free = threading.Event()
        self.free.set()

    def write(self, file: int, data: bytearray) -> int:
        self.free.wait()
        return super().write(file, data)

    def sync(self, file: int) -> None:
        self.free.wait()
        super().sync(file)


class Crossings(RuleBasedStateMachine):
    """One exchange with its threads; this thread is the service and, in turn, the control thread."""

    @initialize()
    def begin(self) -> None:
        self._folder = tempfile.TemporaryDirectory()
        self._disk = _Disk()
        self._checking = threading.Event()
        """Clear while a recording that is being checked keeps whoever checks it waiting."""
        self._checking.set()
        build = references.build

        def build_when_allowed(*arguments: Any) -> Any:
            self._checking.wait()
            return build(*arguments)

        self._patch = mock.patch.object(references, "build", build_when_allowed)
        self._patch.start()
        self._stepped = Stepped(Path(self._folder.name))
        self.service = Service(Path(self._folder.name), self._disk)
        self.service.link.start()
        self._number = 0
        self._writer: JournalWriter | None = None
        self._samples = 0
        self._refusing = False
        """The newest snapshot says that nothing can be loaded."""
        self._open: dict[int, int] = {}
        """Number of each command that has no answer yet, and how many Stops had been sent before it."""
        self._stops = 0
        self._loaded: list[int] = []
        """Loads that the builder has not been asked for yet, or has not answered."""

    # -- what may happen ----------------------------------------------------------------------------------------------

    @rule(command=st.sampled_from(_STARTS))
    def a_command_is_sent(self, command: Command) -> None:
        self._ask(command)

    @rule(huge=st.booleans())
    def a_load_is_sent(self, huge: bool) -> None:
        number = self._ask(_HUGE if huge else message())
        if self._refusing:
            # By mode, and before anything else.
            self._answer(number, refused_only=True)
            assert all(sent.id != number for sent in self.service.loader.sent), "a recording was checked for nothing"
        else:
            self._loaded.append(number)

    @rule(mode=st.sampled_from(["idle", "playing"]))
    def the_mode_is_published(self, mode: Any) -> None:
        """The newest snapshot: while something plays nothing can be loaded."""
        refusal = not_in_this_mode("load", mode)
        self._refusing = refusal is not None
        refusals = {"load": refusal} if refusal else {}
        snapshot = msgspec.structs.replace(self._stepped.snapshot, mode=mode, refusals=refusals)
        self.service.link.publish_snapshot(snapshot)
        self.service.link.wake()
        until(lambda: self.service.link._latest_snapshot is snapshot)

    @rule()
    def a_stop_is_sent(self) -> None:
        """It reaches the control thread, and is answered, whatever waits."""
        before = set(self._open)
        number = self._ask(Stop())
        self._stops += 1
        link = self.service.link
        until(link.take_stop)
        self._answer(number)
        while (taken := link.take_command()) is not None:
            assert taken.id not in before, "a command from before the Stop was carried out after it"

    @rule()
    def the_control_thread_takes(self) -> None:
        link = self.service.link
        while (taken := link.take_command()) is not None:
            assert self._open[taken.id] == self._stops, "a command from before a Stop was carried out after it"
            link.reply(Reply(id=taken.id))
            link.wake()
            self._answer(taken.id)

    @precondition(lambda self: self._loaded)
    @rule()
    def the_builder_answers(self) -> None:
        self.service.loader.answer(self._loaded.pop(0), _REFERENCE)
        self.service.link.notify()

    @rule()
    def a_recording_is_being_checked(self) -> None:
        self._checking.clear()

    @rule()
    def the_disk_waits(self) -> None:
        self._disk.free.clear()

    @rule()
    def nothing_waits(self) -> None:
        self._disk.free.set()
        self._checking.set()

    @rule()
    def something_is_measured(self) -> None:
        if self._writer is None:
            self._writer = self.service.link.open_journal(HEADER)
        give(self._writer, self._samples * 10_000_000)
        self._samples += 1
        self.service.link.wake()

    @invariant()
    def the_threads_live(self) -> None:
        assert not hasattr(self, "service") or not self.service.link.closing, "a thread has ended"

    def teardown(self) -> None:
        if not hasattr(self, "service"):
            return
        self.nothing_waits()
        if self._writer:
            self._writer.finish(JournalEnd(reason="stopped"))
        self.service.link.finish()
        self.service.close()
        self._patch.stop()
        self._folder.cleanup()

    # -- parts --------------------------------------------------------------------------------------------------------

    def _ask(self, command: Command) -> int:
        self._number += 1
        self._open[self._number] = self._stops
        if isinstance(command, Load):
            for part in parts_of(self._number, command):
                self.service.send(part)
        else:
            self.service.ask(self._number, command)
        return self._number

    def _answer(self, number: int, *, refused_only: bool = False) -> None:
        """Wait for the answer to a command. Others may come first."""
        while number in self._open:
            heard = self.service.hear()
            if isinstance(heard, Reply):
                self._open.pop(heard.id, None)
                assert not (refused_only and heard.id == number) or heard.refusal
