"""Two hundred kills of the device process, in teaching and playback in turns, and ten of its service, in a quarter of an hour. Two
hundred kills of a service to which several people write, in another quarter.

`--log-cli-level info` logs each kill, and the figures at the end.
"""

import logging
import math
import random
import statistics
from contextlib import closing
from pathlib import Path

import pytest

from tests.support.device_kills import KeptClinic, Kill, hang_up_while_playing, kill_at_random
from tests.support.service_kills import KilledClinic

KILLS = 200

log = logging.getLogger(__name__)


@pytest.mark.campaign
@pytest.mark.timeout(3600)
def test_two_hundred_kills(tmp_path: Path) -> None:
    kills: list[Kill] = []
    wrong: list[str] = []
    with closing(KeptClinic(tmp_path)) as clinic:
        for seed in range(KILLS):
            try:
                kills.append(kill_at_random(clinic, seed))
                kills[-1].judge()
                assert kills[-1].missing <= 1, kills[-1]
            except AssertionError as error:
                wrong.append(f"{seed}: {error}")
            log.info("%d: %s", seed, wrong[-1] if wrong and wrong[-1].startswith(f"{seed}:") else kills[-1])
    _tell(kills)
    assert wrong == []


@pytest.mark.campaign
def test_ten_killed_services(tmp_path: Path) -> None:
    with closing(KeptClinic(tmp_path)) as clinic:
        off_ms = [max(hang_up_while_playing(clinic, 0.3 + n / 10)) for n in range(10)]
    log.info("torque off: median %.1f ms, largest %.1f ms", statistics.median(off_ms), max(off_ms))
    assert max(off_ms) <= 300.0


@pytest.mark.campaign
@pytest.mark.timeout(7200)
def test_two_hundred_killed_services_that_wrote(tmp_path: Path) -> None:
    clinic, chance, acknowledged = KilledClinic(tmp_path), random.Random(), 0
    for number in range(KILLS):
        left = clinic.kill(chance.uniform(0.0, 0.5))
        acknowledged += left.acknowledged
        log.info("%d: %d changes acknowledged, %d rows of the audit trail", number, left.acknowledged, left.rows)
    log.info("%d kills; %d changes acknowledged, none lost; %d rows, one chain", KILLS, acknowledged, left.rows)


def _tell(kills: list[Kill]) -> None:
    missing = [kill.missing for kill in kills]
    log.info(
        "%d kills; samples missing: %s; last record cut: %d",
        len(kills),
        {count: missing.count(count) for count in sorted(set(missing))},
        sum(kill.cut for kill in kills),
    )
    for name in ("tripped_ms", "moved_ms"):
        times = [getattr(kill, name) for kill in kills if not math.isnan(getattr(kill, name))]
        log.info("%s: median %.1f, largest %.1f", name, statistics.median(times), max(times))
