"""Somebody guesses passwords, so many times a minute. In a process of its own, with no more than what stands on the network."""

import argparse
import json
import sys
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from http.client import HTTPConnection, HTTPException
from statistics import median
from threading import Event, Lock
from typing import Final, Literal
from urllib.parse import urlsplit

import msgspec

from kata.bench.helper_process import helper_process
from kata.bench.running_service import BenchError, RunningService

Kind = Literal["one", "many"]
"""Of one user name from one address; or each try of another name, from a hundred addresses: what no back-off holds up."""
KNOWN: Final = "known-0"
"""A user name that there is."""
_ADDRESSES: Final = 100
_GUESSERS: Final = 16
_LIMIT_S: Final = 30.0
_REFUSED: Final = 429
_WRONG: Final = 401


class GuessingFigures(msgspec.Struct):
    """What came of it."""

    tries: int = 0
    locked_out: int = 0
    """Refused without a look at the password."""
    weighed: int = 0
    """The password was looked at, and was wrong."""
    others: int = 0
    """Any other answer, or none."""
    first_locked_out: int = 0
    """Which try was the first to be refused; 0: none."""
    answer_ms: float = 0.0
    """Median until the answer."""


@dataclass(frozen=True)
class Try:
    """One answer."""

    status: int
    took_ms: float


def guess(url: str, username: str, password: str, address: str) -> Try:
    """Try to sign in from this address of the loopback network; the status is 0 where there was no answer."""
    where = urlsplit(url)
    connection = HTTPConnection(where.hostname or "", where.port, timeout=_LIMIT_S, source_address=(address, 0))
    body = json.dumps({"username": username, "password": password})
    try:
        connection.connect()
        began = time.perf_counter()
        connection.request("POST", "/api/sign-in", body, {"Content-Type": "application/json"})
        answer = connection.getresponse()
        answer.read()
        return Try(answer.status, (time.perf_counter() - began) * 1000)
    except (OSError, HTTPException):
        return Try(0, 0.0)
    finally:
        connection.close()


@contextmanager
def guess_passwords(guessed: GuessingFigures, per_minute: int, kind: Kind, service: RunningService) -> Iterator[None]:
    """A storm on the service while the block lasts; then ``guessed`` is told what came of it."""
    arguments = ["--url", service.url, "--per-minute", str(per_minute), "--kind", kind]
    with helper_process("benchmarks.password_guessing", *arguments, failure="the storm could not begin") as output:
        yield
    try:
        told = msgspec.json.decode(output.text, type=GuessingFigures)
    except msgspec.DecodeError as error:
        raise BenchError("the storm has told nothing") from error
    for name, value in msgspec.structs.asdict(told).items():
        setattr(guessed, name, value)


class _Guessing:
    """Tries at their times, whoever of the guessers is free; one that comes late is made late, none is left out."""

    def __init__(self, url: str, per_minute: int, kind: Kind) -> None:
        self._url, self._kind = url, kind
        self._apart_s = 60.0 / per_minute
        self._began_s = time.monotonic()
        self._lock, self._next = Lock(), 0
        self.over = Event()
        self.answers: dict[int, Try] = {}

    def guess_on(self) -> None:
        while True:
            with self._lock:
                number, self._next = self._next, self._next + 1
            if self.over.wait(max(0.0, self._began_s + number * self._apart_s - time.monotonic())):
                return
            one = self._kind == "one"
            name = KNOWN if one else f"nobody-{number}"
            address = "127.0.0.1" if one else f"127.0.1.{number % _ADDRESSES + 1}"
            self.answers[number] = guess(self._url, name, f"password-{number}", address)

    def guessed(self) -> GuessingFigures:
        status = {number: one.status for number, one in sorted(self.answers.items())}
        refused = [number for number, code in status.items() if code == _REFUSED]
        weighed = sum(code == _WRONG for code in status.values())
        return GuessingFigures(
            tries=len(status),
            locked_out=len(refused),
            weighed=weighed,
            others=len(status) - len(refused) - weighed,
            first_locked_out=min(refused, default=-1) + 1,
            answer_ms=median([one.took_ms for one in self.answers.values()]) if self.answers else 0.0,
        )


def main() -> None:
    """Entry of ``python -m benchmarks.password_guessing``."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.password_guessing", description=__doc__)
    parser.add_argument("--url", required=True, help="the service, on this computer")
    parser.add_argument("--per-minute", type=int, required=True, help="tries a minute")
    parser.add_argument("--kind", choices=("one", "many"), required=True, help="of one name, or each of another")
    arguments = parser.parse_args()
    storm = _Guessing(arguments.url, arguments.per_minute, arguments.kind)
    with ThreadPoolExecutor(_GUESSERS) as guessers:
        guessing = [guessers.submit(storm.guess_on) for _ in range(_GUESSERS)]
        sys.stdout.write("ready\n")
        sys.stdout.flush()
        sys.stdin.read()
        storm.over.set()
    for one in guessing:
        one.result()
    sys.stdout.write(json.dumps(msgspec.structs.asdict(storm.guessed())))


if __name__ == "__main__":
    main()
