"""Samples of a recording or a run as CSV, Parquet or MCAP: one table with units in the column names and the origin in the metadata. A run
also as a dataset of LeRobot. Only the worker process imports this module (:mod:`kata.interop.sample_file`).
"""

import math
from datetime import datetime
from pathlib import Path
from typing import Any, Final

import numpy as np
from arro3.core import Array, DataType, Field, Schema, Table
from arro3.io import write_csv, write_parquet
from numpy.typing import NDArray

from kata.device import journal
from kata.interop.lerobot_file import LeRobotEpisode, write_lerobot
from kata.interop.mcap_file import write_mcap
from kata.interop.sample_file import SIMULATED, Origin, SampleFormat
from kata.motion.axes import AXES
from kata.motion.tracking import wall_clock_s

SCHEMA_VERSION: Final = "kata-samples-table/1"
_DECIMALS: Final = {"s": 6, "deg": 4, "Nm": 4}
"""Decimals by unit. They match the resolution of stored samples."""
_RECORDING_COLUMNS: Final = {"angle_deg": ("motor_{}_deg", "deg")}
_RUN_COLUMNS: Final = {
    "setpoint_deg": ("motor_{}_setpoint_deg", "deg"),
    "measured_deg": ("motor_{}_measured_deg", "deg"),
    "torque_nm": ("motor_{}_torque_nm", "Nm"),
}
_PHASES: Final = ", ".join(
    f"{number} {name}"
    for number, name in (
        (journal.PHASE_APPROACHING, "approaching"),
        (journal.PHASE_PLAYING, "playing"),
        (journal.PHASE_PAUSED, "paused"),
        (journal.PHASE_RETURNING, "returning"),
        (journal.PHASE_STOPPING, "stopping"),
        (journal.PHASE_REVERSING, "moving back after resistance"),
        (journal.PHASE_REDUCED_RANGE, "playing with reduced range"),
    )
)


def write_table(
    samples: dict[str, NDArray[np.float64]], origin: Origin, sample_format: SampleFormat, path: Path
) -> None:
    """Write samples to a file."""
    if sample_format == "lerobot.zip":
        write_lerobot(samples, _episode(origin), path)
        return
    table = _table(samples, origin)
    if sample_format == "csv":
        write_csv(table, path)
    elif sample_format == "mcap":
        write_mcap(table, origin.kind, datetime.fromisoformat(origin.begins_at), _metadata(origin), path)
    else:
        write_parquet(
            table,
            path,
            compression="snappy",
            dictionary_enabled=False,
            created_by="Kata",
            max_row_group_size=1 << 16,
            key_value_metadata=_metadata(origin),
        )


def _episode(origin: Origin) -> LeRobotEpisode:
    """Describe a run as an episode. LeRobot shows task and robot, so both mark a simulated apparatus."""
    assert origin.kind == "run" and origin.rate_hz
    robot = "kata-shoulder-apparatus" + ("-simulated" if origin.simulated else "")
    task = f"Move the {origin.side} arm of a patient along a taught motion"
    return LeRobotEpisode(
        origin.rate_hz, task + (" (simulated apparatus)" if origin.simulated else ""), robot, _metadata(origin)
    )


def _table(samples: dict[str, NDArray[np.float64]], origin: Origin) -> Table:
    arrays: list[Array] = []
    fields: list[Field] = []

    def add(name: str, unit: str, values: NDArray[np.float64]) -> None:
        rounded = np.round(values, _DECIMALS[unit])
        # Only the position on the motion can be missing. A list is slow, but there is no other way to write null.
        array = (
            Array([None if math.isnan(value) else value for value in rounded.tolist()], DataType.float64())
            if np.isnan(rounded).any()
            else Array.from_numpy(rounded)
        )
        arrays.append(array)
        fields.append(Field(name, DataType.float64(), nullable=True, metadata={"unit": unit}))

    add("time_s", "s", samples["time_s"])
    if "phase" in samples:
        arrays.append(Array.from_numpy(samples["phase"].astype(np.int8)))
        fields.append(Field("phase", DataType.int8(), nullable=True, metadata={"values": _PHASES}))
        add("path_s", "s", samples["path_s"])
        add("wall_s", "s", _wall_s(samples))
    for column, (name, unit) in (_RECORDING_COLUMNS if "angle_deg" in samples else _RUN_COLUMNS).items():
        for axis, motor in enumerate(AXES):
            add(name.format(motor), unit, np.ascontiguousarray(samples[column][:, axis]))
    if origin.simulated:
        # CSV has no metadata, so only a column marks every value, also in copied rows.
        arrays.append(Array.from_numpy(np.ones(len(samples["time_s"]), dtype=np.int8)))
        fields.append(Field(SIMULATED, DataType.int8(), nullable=True, metadata={"values": "1 simulated apparatus"}))
    return Table.from_arrays(arrays, schema=Schema(fields, metadata=_metadata(origin)))


def _wall_s(samples: dict[str, NDArray[np.float64]]) -> NDArray[np.float64]:
    moving = np.isin(samples["phase"], (journal.PHASE_PLAYING, journal.PHASE_REDUCED_RANGE))
    return wall_clock_s(samples["time_s"], samples["path_s"], moving)


def _metadata(origin: Origin) -> dict[str, str]:
    metadata: dict[str, Any] = {
        "schema": SCHEMA_VERSION,
        f"{origin.kind}_id": origin.id,
        "patient_id": origin.patient_id,
        "side": origin.side,
        "station": origin.station,
        "rate_hz": "" if origin.rate_hz is None else str(origin.rate_hz),
        "axis_order": "motors 1 to 5: scapula 1, scapula 2, shoulder abduction, shoulder flexion, external rotation",
        "clock": "time_s counts from the first sample, by the device's monotonic clock at the arrival of the motors' answers",
        "begins_at": origin.begins_at,
        "simulated": "yes: the apparatus was simulated, the values are invented" if origin.simulated else "no",
        "angles": "motor angles; neither the apparatus angle of a motion nor the patient's angle",
    }
    if origin.kind == "run":
        metadata["path_s"] = "position on the requested motion, in seconds; empty while the arm moves to the start"
        metadata["wall_s"] = (
            "wall-clock time on the motion. It equals path_s when a playback starts or resumes. Empty outside playback"
        )
        metadata["errors"] = (
            "The tracking error is measured minus requested angle. The change by settings is requested minus taught angle. This table has "
            "neither: compare by path_s, not by setpoint"
        )
    return metadata
