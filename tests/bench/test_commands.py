"""``kata bench`` has every benchmark in a checkout; an installed one names those that need a checkout."""

import subprocess
import sys

import pytest

from kata.bench.commands import CHECKOUT_ONLY

KATA = "from kata.__main__ import main; "
WITHOUT_BENCHMARKS = "import sys; sys.modules['benchmarks'] = None; "


def kata_bench(before: str, *arguments: str) -> "subprocess.CompletedProcess[str]":
    command = [sys.executable, "-c", f"{before}{KATA}main()", "bench", *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=60)


def test_checkout_has_every_benchmark() -> None:
    done = kata_bench("", "--help")
    assert done.returncode == 0
    assert all(f" {name} " in done.stdout for name in ("loop", "bus", "estop", "stop", *CHECKOUT_ONLY))
    assert "Only in a checkout" not in done.stdout


@pytest.mark.parametrize("name", CHECKOUT_ONLY)
def test_installed_command_says_where_the_benchmark_is(name: str) -> None:
    done = kata_bench(WITHOUT_BENCHMARKS, name, "--seconds", "1")
    assert done.returncode == 1
    assert f"python -m benchmarks {name}" in done.stderr.replace("\n", " ")
