"""Several motions made into one programme, with a session timer."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import cycle

from kata.motion.edit import JOIN_SPEED_DEG_S, LONGEST_S, EditError, Line, Motion, eased


@dataclass(frozen=True)
class Step:
    """One motion of a programme: how often, and the pause at each end."""

    motion: Motion
    repetitions: int = 1
    pause_s: float = 0.0


def chained(
    steps: Sequence[Step], session_s: float | None = None, join_speed_deg_s: float = JOIN_SPEED_DEG_S
) -> Motion:
    """One motion after the other, each as often as its step says, joined by minimum jerk.

    :param session_s: the programme begins again from its first step until so much time has gone by, and ends after the
        repetition in which that happens, be the programme through or not. None: once through.
    :raises EditError: when there are no steps, one makes no sense, or it would last no time or more than an hour.
    """
    if not steps or any(step.repetitions < 1 or not step.pause_s >= 0 for step in steps):
        raise EditError("a programme needs steps of at least one repetition, with pauses of 0 s or more")
    once_s = sum(step.repetitions * (step.motion.duration_s + step.pause_s) for step in steps)
    if not 0 < (once_s if session_s is None else session_s) <= LONGEST_S:
        raise EditError("a programme must last more than nothing and at most an hour")
    line = Line(join_speed_deg_s)
    repetitions = [(eased(step.motion), step.pause_s) for step in steps for _ in range(step.repetitions)]
    done = 0
    for motion, pause_s in repetitions if session_s is None else cycle(repetitions):
        line.join(motion, pause_s)
        done += 1
        if session_s is not None and line.duration_s >= session_s:
            break
    timer = "" if session_s is None else f" in a session of {session_s:g} s"
    return line.motion((f"a programme of {len(steps)} motions, {done} repetitions{timer}",))
