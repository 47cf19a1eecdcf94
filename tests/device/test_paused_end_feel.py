"""A paused end-feel test holds the shoulder with at most the chosen torque."""

from kata.device.ipc_messages import Pause
from tests.device.test_end_feel import CHOSEN_NM, ONCE, Shoulder, started
from tests.support.stepped import Stepped


def test_paused_test_gives_way_above_the_chosen_torque(stepped: Stepped) -> None:
    """The patient guards while the arm is held in the stretch. The patient's level is far above the chosen torque."""
    started(stepped, ONCE)
    shoulder = Shoulder(stepped)
    while shoulder.largest_nm < CHOSEN_NM / 2:
        shoulder.cycle()
    assert stepped.send(Pause()) is None
    shoulder.until("paused")
    before_deg = stepped.apparatus.angles_deg[3]
    shoulder.guarding_nm = 2.4
    shoulder.forward(1.0)
    assert stepped.causes() or stepped.apparatus.angles_deg[3] < before_deg - 0.5
