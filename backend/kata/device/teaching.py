"""Implements a teaching: the pedal starts and ends takes, and samples are written to the journal while it is down."""

from dataclasses import dataclass, field

from kata.device.cycle_state import CycleState
from kata.device.ipc_messages import TeachingState
from kata.device.journal import JournalEnd, JournalWriter, Sample


@dataclass
class Teaching:
    """One teaching from start to end."""

    teaching_id: str
    journal: JournalWriter
    cycles_per_sample: int
    """Number of cycles for each sample."""
    pedal_was_up: bool = False
    """True if the pedal has been up since teaching began. Before that a pressed pedal records nothing."""
    takes: int = 0
    samples: int = 0
    take_began_ns: int | None = None
    """Time at which the present take began; None outside a take."""
    take_s: float = 0.0
    cycles: int = field(init=False)
    """Number of cycles in the present take."""

    def step(self, state: CycleState) -> None:
        """Run one cycle: begin or end a take and record a sample if one is due."""
        if state.pedal_down is not True:
            self.pedal_was_up = self.pedal_was_up or state.pedal_down is False
            self.take_began_ns = None
            return
        if not self.pedal_was_up:
            return
        if self.take_began_ns is None:
            self.takes += 1
            self.cycles = 0
            self.take_began_ns = state.t_ns
        self.take_s = (state.t_ns - self.take_began_ns) / 1e9
        if self.cycles % self.cycles_per_sample == 0 and state.measured_t_ns is not None:
            self.samples += 1
            self.journal.append_sample(
                Sample(
                    t_ns=state.measured_t_ns,
                    take=self.takes,
                    phase=0,
                    path_s=self.take_s,
                    setpoint_deg=state.measured_deg,
                    measured_deg=state.measured_deg,
                    torque_nm=state.torque_nm,
                )
            )
        self.cycles += 1

    def end(self) -> None:
        """Finish the journal."""
        self.journal.finish(JournalEnd(reason="finished"))

    @property
    def recording(self) -> bool:
        """True during a take."""
        return self.take_began_ns is not None

    def state(self) -> TeachingState:
        """Return the teaching for the snapshot."""
        return TeachingState(
            teaching_id=self.teaching_id,
            takes=self.takes,
            recording=self.recording,
            take_s=self.take_s,
            samples=self.samples,
        )
