"""Controls a service of Kata under systemd: its settings, its start and stop, and its health."""

import json
import os
import pwd
import shlex
import shutil
import ssl
import subprocess
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from functools import cached_property
from http.client import HTTPException
from ipaddress import ip_address
from pathlib import Path
from typing import Any, Final
from urllib.error import HTTPError
from urllib.request import Request, urlopen

from kata.settings import Settings

_ANSWER_LIMIT_S: Final = 10.0
_POLL_S: Final = 0.2
_SETTING: Final = "KATA_"
_BUSY: Final = ("station_occupied", "session_open")
"""Codes with which the service refuses to be stopped."""


class UnitError(Exception):
    """A service cannot be stopped, started or queried. The message says why."""


class BusyError(UnitError):
    """The service must not be stopped: its motors have torque, or a session is open."""


class ServiceUnit:
    """One service on this computer, identified by the name of its unit."""

    def __init__(self, name: str) -> None:
        self.name = name

    def stop(self) -> None:
        """Stop the service and wait for its end. The device process ramps down, and its journals are imported.

        :raises UnitError: when systemd refuses.
        """
        self._systemctl("stop", self.name)

    def start(self) -> None:
        """Start the service. Return when it runs or has failed. :meth:`wait_until_ready` shows which."""
        with suppress(UnitError):
            self._systemctl("start", self.name)

    @property
    def has_ended(self) -> bool:
        """True if the service is not running and systemd will not restart it."""
        # Read the state from the output, because the command's status is not 0 if the service is not running.
        return self._systemctl("show", self.name, "--property=ActiveState", "--value").strip() in ("inactive", "failed")

    def check_idle(self) -> None:
        """Ask the service whether it may be stopped. Return without a value if it may.

        :raises BusyError: while torque is on or a session is open.
        :raises UnitError: when the service or its database does not answer.
        """
        status, answer = self._ask("/health/idle")
        if status != 200:
            why = f"{answer.get('detail', status)} {answer.get('next_step', '')}".strip()
            kind = BusyError if answer.get("code") in _BUSY else UnitError
            raise kind(f"The service {self.name} must not be stopped now: {why}")

    def wait_until_ready(self, version: str, within_s: float) -> None:
        """Return when the service answers with this version and is ready for a session.

        :raises UnitError: when this does not happen within ``within_s``.
        """
        limit, last = time.monotonic() + within_s, "no answer"
        while time.monotonic() < limit:
            try:
                status, answer = self._ask("/health/ready")
            except UnitError as error:
                last = str(error)
            else:
                if status == 200 and answer.get("version") == version:
                    return
                last = str(answer.get("detail") or f"version {answer.get('version')}")
            if self.has_ended:
                raise UnitError(f"The service {self.name} has ended; its log says why.")
            time.sleep(_POLL_S)
        raise UnitError(f"The service {self.name} was not ready with version {version} within {within_s:.0f} s: {last}")

    def run(self, command: Sequence[str | Path]) -> None:
        """Run a command with the service's user and settings.

        :raises UnitError: when the command fails. The message has the last lines of its output.
        """
        try:
            user = self._property("User") if os.geteuid() == 0 else ""
            group = pwd.getpwnam(user).pw_gid if user else None
            done = subprocess.run(
                command, env=self._environment, cwd="/", user=user or None, group=group, extra_groups=[] if user else None,
                stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False,
            )  # fmt: skip
        except (OSError, LookupError) as error:
            raise UnitError(f"{command[0]} cannot be run: {error}") from error
        if done.returncode != 0:
            raise UnitError(f"{shlex.join(map(str, command))}: {done.stdout.strip()[-2000:]}")

    @cached_property
    def settings(self) -> Settings:
        """Return the service's settings."""
        values = {name.removeprefix(_SETTING).lower(): value for name, value in self._environment.items() if value}
        known: dict[str, Any] = {name: values[name] for name in Settings.model_fields if name in values}
        return Settings(**known)

    @cached_property
    def _environment(self) -> Mapping[str, str]:
        """Return the environment of this process, with that of the unit added."""
        environment = dict(os.environ)
        environment |= _assignments(shlex.split(self._property("Environment")))
        # Each file is followed by its options: "/etc/kata/environment (ignore_errors=yes)".
        for line in self._property("EnvironmentFiles").splitlines():
            file = Path(line.partition(" (")[0])
            if file.is_file():
                environment |= _assignments(shlex.split(file.read_text(), comments=True))
        return environment

    def _property(self, name: str) -> str:
        return self._systemctl("show", self.name, f"--property={name}", "--value").strip()

    def _systemctl(self, *arguments: str) -> str:
        try:
            program = shutil.which("systemctl") or "systemctl"
            done = subprocess.run([program, *arguments], capture_output=True, text=True, check=False)
        except OSError as error:
            raise UnitError(f"systemctl cannot be run: {error.strerror}") from error
        if done.returncode != 0:
            raise UnitError(f"systemctl {' '.join(arguments)}: {done.stderr.strip()}")
        return done.stdout

    def _ask(self, path: str) -> tuple[int, dict[str, Any]]:
        """Return status and body of the service's answer."""
        # Skip verification: no secret is sent, and the certificate is for the names that browsers use.
        context = ssl.create_default_context()
        context.check_hostname, context.verify_mode = False, ssl.CERT_NONE
        request = Request(f"{self._address()}{path}")  # noqa: S310 - http and https only
        try:
            with urlopen(request, timeout=_ANSWER_LIMIT_S, context=context) as answer:  # noqa: S310
                return answer.status, json.load(answer)
        except HTTPError as error:
            try:
                return error.code, json.loads(error.read())
            except ValueError:
                return error.code, {}
        except (OSError, HTTPException, ValueError) as error:
            raise UnitError(f"The service {self.name} does not answer at {self._address()}: {error}.") from error

    def _address(self) -> str:
        host = ip_address(self.settings.host)
        reached = {4: "127.0.0.1", 6: "[::1]"}[host.version] if host.is_unspecified else self.settings.host
        if ":" in reached and not reached.startswith("["):
            reached = f"[{reached}]"
        return f"{'https' if self.settings.encrypted else 'http'}://{reached}:{self.settings.port}"


def _assignments(words: Sequence[str]) -> dict[str, str]:
    return {name: value for name, equals, value in (word.partition("=") for word in words) if equals}
