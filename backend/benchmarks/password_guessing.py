"""Guesses passwords at a constant rate, from a separate process over the network."""

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
"""``one``: one user name from one address. ``many``: each attempt with another name, from a hundred addresses, so that no
back-off applies.
"""
KNOWN: Final = "known-0"
"""An existing user name."""
_ADDRESSES: Final = 100
_THREADS: Final = 16
_LIMIT_S: Final = 30.0
_REFUSED: Final = 429
_WRONG: Final = 401


class GuessingFigures(msgspec.Struct):
    """Figures of the attempts."""

    attempts: int = 0
    locked_out: int = 0
    """Number of attempts that were refused without checking the password."""
    checked: int = 0
    """Number of attempts that were refused after checking the password."""
    others: int = 0
    """Number of attempts with any other answer or none."""
    first_locked_out: int = 0
    """Number of the first attempt that was locked out; 0 for none."""
    answer_ms: float = 0.0
    """Median time until the answer in ms."""


@dataclass(frozen=True)
class Attempt:
    """The answer to one attempt."""

    status: int
    took_ms: float


def guess(url: str, username: str, password: str, address: str) -> Attempt:
    """Try to log in from this address of the loopback network. Without an answer the status is 0."""
    where = urlsplit(url)
    connection = HTTPConnection(where.hostname or "", where.port, timeout=_LIMIT_S, source_address=(address, 0))
    body = json.dumps({"username": username, "password": password})
    try:
        connection.connect()
        began = time.perf_counter()
        connection.request("POST", "/api/sign-in", body, {"Content-Type": "application/json"})
        answer = connection.getresponse()
        answer.read()
        return Attempt(answer.status, (time.perf_counter() - began) * 1000)
    except (OSError, HTTPException):
        return Attempt(0, 0.0)
    finally:
        connection.close()


@contextmanager
def guess_passwords(guessed: GuessingFigures, per_minute: int, kind: Kind, service: RunningService) -> Iterator[None]:
    """Guess passwords during the block. The figures are written to ``guessed`` at the end."""
    arguments = ["--url", service.url, "--per-minute", str(per_minute), "--kind", kind]
    with helper_process("benchmarks.password_guessing", *arguments, failure="the guessing could not begin") as output:
        yield
    try:
        result = msgspec.json.decode(output.text, type=GuessingFigures)
    except msgspec.DecodeError as error:
        raise BenchError("the guessing reported no figures") from error
    for name, value in msgspec.structs.asdict(result).items():
        setattr(guessed, name, value)


class _Guessing:
    """Distributes the attempts among the threads. Each attempt has its time. A late attempt is still made."""

    def __init__(self, url: str, per_minute: int, kind: Kind) -> None:
        self._url, self._kind = url, kind
        self._interval_s = 60.0 / per_minute
        self._began_s = time.monotonic()
        self._lock, self._next = Lock(), 0
        self.over = Event()
        self.answers: dict[int, Attempt] = {}

    def run(self) -> None:
        while True:
            with self._lock:
                number, self._next = self._next, self._next + 1
            if self.over.wait(max(0.0, self._began_s + number * self._interval_s - time.monotonic())):
                return
            single = self._kind == "one"
            name = KNOWN if single else f"nobody-{number}"
            address = "127.0.0.1" if single else f"127.0.1.{number % _ADDRESSES + 1}"
            self.answers[number] = guess(self._url, name, f"password-{number}", address)

    def guessed(self) -> GuessingFigures:
        status = {number: answer.status for number, answer in sorted(self.answers.items())}
        refused = [number for number, code in status.items() if code == _REFUSED]
        checked = sum(code == _WRONG for code in status.values())
        return GuessingFigures(
            attempts=len(status),
            locked_out=len(refused),
            checked=checked,
            others=len(status) - len(refused) - checked,
            first_locked_out=min(refused, default=-1) + 1,
            answer_ms=median([answer.took_ms for answer in self.answers.values()]) if self.answers else 0.0,
        )


def main() -> None:
    """Run ``python -m benchmarks.password_guessing``."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.password_guessing", description=__doc__)
    parser.add_argument("--url", required=True, help="the service, on this computer")
    parser.add_argument("--per-minute", type=int, required=True, help="attempts per minute")
    parser.add_argument(
        "--kind", choices=("one", "many"), required=True, help="one name, or another name for each attempt"
    )
    arguments = parser.parse_args()
    guesses = _Guessing(arguments.url, arguments.per_minute, arguments.kind)
    with ThreadPoolExecutor(_THREADS) as pool:
        guessing = [pool.submit(guesses.run) for _ in range(_THREADS)]
        sys.stdout.write("ready\n")
        sys.stdout.flush()
        sys.stdin.read()
        guesses.over.set()
    for future in guessing:
        future.result()
    sys.stdout.write(json.dumps(msgspec.structs.asdict(guesses.guessed())))


if __name__ == "__main__":
    main()
