"""Random interleavings of messages between the service and the control thread, through the real link and its threads.

The sequence decides how long a write, a sync or the check of a recording takes; it may never end. A Stop must pass them. Nothing here
depends on the speed of the computer: a blocked thread waits until a rule releases it.
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
from kata.device.ipc_messages import (
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
from kata.device.journal import JournalDisk, JournalEnd, JournalWriter
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
    """Blocks each write and sync until it is released."""

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
    """One link with its threads. This thread takes the part of the service and of the control thread."""

    @initialize()
    def begin(self) -> None:
        self._folder = tempfile.TemporaryDirectory()
        self._disk = _Disk()
        self._checking = threading.Event()
        """Cleared while the check of a recording is blocked."""
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
        """Each unanswered command by its number, with the number of Stops sent before it."""
        self._stops = 0
        self._loaded: list[int] = []
        """Loads that the builder has not answered, or not received yet."""

    # -- rules ------------------------------------------------------------------------------------------------------

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
        """Publish a snapshot; during playback nothing can be loaded."""
        refusal = not_in_this_mode("load", mode)
        self._refusing = refusal is not None
        refusals = {"load": refusal} if refusal else {}
        snapshot = msgspec.structs.replace(self._stepped.snapshot, mode=mode, refusals=refusals)
        self.service.link.publish_snapshot(snapshot)
        self.service.link.wake()
        until(lambda: self.service.link._latest_snapshot is snapshot)

    @rule()
    def a_stop_is_sent(self) -> None:
        """A Stop reaches the control thread and is answered, also while other threads are blocked."""
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
        """Wait for the answer to a command; other messages may come first."""
        while number in self._open:
            heard = self.service.hear()
            if isinstance(heard, Reply):
                self._open.pop(heard.id, None)
                assert not (refused_only and heard.id == number) or heard.refusal
