"""The drafted note, sentence by sentence."""

from datetime import UTC, datetime
from string import Formatter
from typing import Any
from uuid import UUID, uuid4

import pytest

from kata.clinic.sessions.ending import suggested_reason
from kata.clinic.sessions.schemas import (
    Comparison,
    MotionTracking,
    MotorTracking,
    Run,
    RunStop,
    Session,
    SessionItem,
    SessionPatient,
    SessionProgramme,
)
from kata.reporting.note_draft import draft
from kata.reporting.note_draft_phrases import PHRASES
from kata.station.schemas import TextKey

AT = datetime(2026, 11, 21, 9, 0, tzinfo=UTC)
ANGLE: dict[str, Any] = {
    "peak_at_s": 1.0, "rmse_deg": 0.5, "start_deg": 0.1, "lag_ms": 10.0, "taught_min_deg": 0.0, "taught_max_deg": 90.0,
    "played_min_deg": 0.0, "played_max_deg": 90.0, "taught_smoothness": -1.5, "played_smoothness": -1.5,
}  # fmt: skip

DRIVE_3_SILENT = TextKey(code="drive_silent", params={"motor": 3})


def compared(peaks: tuple[float, ...] = (0.1, 0.2, 1.0, -2.4, 0.3), **reached: float) -> Comparison:
    motors = [MotorTracking(motor=n, torque_peak_nm=1.0, peak_deg=peak, **ANGLE) for n, peak in enumerate(peaks, 1)]
    motion = MotionTracking(
        motion=4, name="Abduction / adduction of the shoulder", apparatus_min_deg=0, apparatus_max_deg=120,
        reference_min_deg=0, reference_max_deg=180, peak_deg=1.0, **ANGLE | reached,
    )  # fmt: skip
    return Comparison(samples=10, motors=motors, motions=[motion])


def run(name: str = "Abduction", **given: Any) -> Run:
    plain: dict[str, Any] = {
        "id": uuid4(), "session_id": uuid4(), "recording_id": UUID(int=1), "recording_name": name, "started_at": AT,
        "ended_at": AT, "outcome": "completed", "stop": None, "rate_hz": 100, "method": "smooth", "resistance_level": 8,
        "programme_position": None, "repetitions_done": 1, "reversals": 0, "least_range_percent": None,
        "comparison": None,
    }  # fmt: skip
    return Run(**plain | given)


def programme(*names: str) -> SessionProgramme:
    items = [
        SessionItem(
            position=n,
            recording_id=UUID(int=n),
            recording_name=name,
            resistance_level=8,
            method="smooth",
            repetitions=10,
        )
        for n, name in enumerate(names, start=1)
    ]
    return SessionProgramme(
        id=uuid4(), name="Weeks 3 to 6", version_id=uuid4(), number=2, timer_minutes=None, items=items
    )


def session(*runs: Run, **given: Any) -> Session:
    plain: dict[str, Any] = {
        "id": uuid4(), "patient": SessionPatient(id=uuid4(), name="N", clinic_number="1"), "episode_id": uuid4(),
        "side": "left", "therapist": "Ito Mai", "station": "Station 1", "programme": None, "started_at": AT,
        "ended_at": None, "end_reason": None, "checks": [], "pain_before": None, "pain_during": None,
        "pain_after": None, "note": "", "signed_at": None, "signed_by": "", "addenda": [], "updated_at": AT,
        "runs": list(runs),
    }  # fmt: skip
    return Session(**plain | given)


def test_draft_begins_with_side_and_programme() -> None:
    planned = session(run(programme_position=1), programme=programme("Abduction"))
    assert draft(planned).startswith("Left shoulder, programme Weeks 3 to 6 (version 2). ")
    assert draft(session(run())).startswith("Left shoulder, without a programme. ")


def test_draft_keeps_the_other_shoulder_apart() -> None:
    reached = [compared(played_min_deg=0.0, played_max_deg=high) for high in (90.0, 150.0)]
    text = draft(session(run(side="left", comparison=reached[0]), run("Lift", side="right", comparison=reached[1])))
    assert "Lift, right shoulder: 1 of 1 repetition." in text
    assert "shoulder 0 to 90°." in text and "150" not in text


def test_draft_of_a_simulated_session_says_so() -> None:
    assert "Simulated apparatus" in draft(session(run(), simulated=True))
    assert "模擬装置" in draft(session(run(), simulated=True), "ja")
    assert "Simulated" not in draft(session(run()))


def test_draft_reports_when_nothing_was_played() -> None:
    assert draft(session(run(outcome="unloaded"), pain_before=4)) == (
        "Left shoulder, without a programme. Nothing was played. Pain (0 to 10): 4 before."
    )


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ({}, "Abduction: 1 of 1 repetition."),
        ({"repetitions": 10, "repetitions_done": 8}, "Abduction: 8 of 10 repetitions."),
        ({"repetitions": 10, "repetitions_done": None}, "Abduction: 10 of 10 repetitions."),
        (
            {"repetitions": 2, "repetitions_done": 2, "speed_percent": 50, "range_percent": 80, "pause_s": 2},
            "Abduction (80 % of the range, 50 % speed, pause 2 s): 2 of 2 repetitions.",
        ),
        ({"method": "learned"}, "Abduction (learned): 1 of 1 repetition."),
        ({"self_paced": True}, "Abduction (pace set by the patient): 1 of 1 repetition."),
        (
            {"outcome": "stopped", "repetitions_done": 0, "stop": RunStop(code="estop_pressed", message="Pressed.")},
            "Abduction was stopped: Pressed.",
        ),
        ({"outcome": "returned"}, "Abduction was ended early."),
        ({"outcome": "interrupted"}, "Abduction was interrupted: the control program ended."),
        ({"reversals": 1}, "In Abduction the arm met resistance and was moved back once (level 8)."),
        ({"reversals": 3}, "In Abduction the arm met resistance and was moved back 3 times (level 8)."),
        (
            {"least_range_percent": 70.0},
            "The range was reduced in Abduction: part of it was played with 70 % of the range.",
        ),
        ({"comparison": compared()}, "Tracking error at most 2.4° (motor 4, RMSE 0.5°)."),
        (
            {"comparison": compared(played_min_deg=4.6, played_max_deg=98.6)},
            "Apparatus angle reached (not the patient's angle: the arm can slip in its cuff): abduction / adduction of the shoulder 5 to 99°.",
        ),
    ],
)
def test_each_event_is_one_sentence(given: dict[str, Any], sentence: str) -> None:
    text = draft(session(run(**given)))
    assert sentence in text
    assert draft(session(run())) == "Left shoulder, without a programme. Abduction: 1 of 1 repetition."


def test_planned_repetitions_come_from_the_programme_and_omissions_are_named() -> None:
    planned = programme("Abduction", "Flexion")
    text = draft(session(run(programme_position=1, repetitions=5, repetitions_done=5), programme=planned))
    assert "Abduction: 5 of 10 repetitions. Not played: Flexion." in text


def test_the_widest_range_of_all_runs_counts() -> None:
    first = run(comparison=compared(played_min_deg=10, played_max_deg=80))
    second = run(comparison=compared(played_min_deg=5, played_max_deg=70))
    assert "slip in its cuff): abduction / adduction of the shoulder 5 to 80°." in draft(session(first, second))


def test_each_end_of_patients_angle_is_of_its_furthest_run() -> None:
    def estimated(low: float, high: float) -> Run:
        return run(
            comparison=compared(
                played_min_deg=low, played_max_deg=high, patient_min_deg=low - 5, patient_max_deg=high - 5,
                patient_min_uncertainty_deg=4, patient_max_uncertainty_deg=6,
            )
        )  # fmt: skip

    text = draft(session(estimated(-40, 10), estimated(-10, 60)))
    assert "abduction / adduction of the shoulder -45° ± 4° to 55° ± 6°." in text


def test_run_of_another_recording_is_not_the_planned_item() -> None:
    other = run("Flexion", recording_id=UUID(int=9), programme_position=1, repetitions=5, repetitions_done=5)
    text = draft(session(other, programme=programme("Abduction")))
    assert "Flexion: 5 of 5 repetitions. Not played: Abduction." in text


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ({"repetitions": 10, "repetitions_done": 8, "speed_percent": 50}, "挙上(速度50%)：10回中8回実施。"),
        (
            {
                "outcome": "stopped",
                "stop": RunStop(code="drive_silent", message="Motor 3 does not answer.", message_key=DRIVE_3_SILENT),
            },
            "「挙上」は停止した。原因：モータ3が応答しない。",
        ),
        ({"reversals": 3}, "「挙上」で腕が抵抗を受け、3回引き戻された(抵抗許容レベル8)。"),
        ({"least_range_percent": 70.0}, "「挙上」では可動範囲を狭める操作があり、一部を範囲70%で実施。"),
        (
            {"comparison": compared(played_min_deg=4.6, played_max_deg=98.6)},
            "到達した装置角度(患者の角度ではない。腕は固定具の中で滑ることがある)：肩関節 外転・内転 5〜99°。追従誤差は最大2.4°(モータ4、RMSE 0.5°)。",
        ),
        ({}, "痛み(0〜10)：前4、後2。"),
    ],
)
def test_draft_says_the_same_in_japanese(given: dict[str, Any], sentence: str) -> None:
    text = draft(session(run("挙上", **given), pain_before=4, pain_after=2), "ja")
    assert text.startswith("左肩、プログラムなし。")
    assert sentence in text
    assert not any(word in text for word in ("shoulder", "range", "Motor", "motor"))


def test_every_sentence_takes_the_same_values_in_both_languages() -> None:
    for key, (english, japanese) in PHRASES.items():
        values = [{name for _, name, _, _ in Formatter().parse(words) if name} for words in (english, japanese)]
        assert values[1] == values[0], key


def test_draft_reports_the_recorded_pain() -> None:
    assert draft(session(run(), pain_before=4, pain_after=0)).endswith("Pain (0 to 10): 4 before, 0 after.")
    assert draft(session(run(), pain_before=4, pain_during=6, pain_after=2)).endswith("4 before, 6 during, 2 after.")


@pytest.mark.parametrize(
    ("planned", "runs", "reason"),
    [
        (programme("A", "B"), [run(programme_position=2), run(programme_position=1)], "completed"),
        (programme("A", "B"), [run(programme_position=1)], "shortened"),
        (programme("A"), [run(programme_position=1, outcome="stopped")], "stopped"),
        (programme("A"), [run(programme_position=1), run(outcome="stopped")], "completed"),
        (None, [run()], "completed"),
        (None, [run(outcome="interrupted")], "stopped"),
        (None, [run(outcome="returned")], "shortened"),
        (None, [run(outcome="unloaded")], "shortened"),
        (None, [], "shortened"),
    ],
)
def test_end_name_follows_from_the_events(planned: SessionProgramme | None, runs: list[Run], reason: str) -> None:
    assert suggested_reason(planned.items if planned else [], runs) == reason


def test_errors_of_a_partial_run_are_not_noted() -> None:
    assert "Tracking error" in draft(session(run(comparison=compared())))
    assert "Tracking error" not in draft(session(run(comparison=compared(), partial=True)))
