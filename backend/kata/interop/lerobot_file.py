"""Write the samples of a run as a LeRobotDataset, format v3.0, with one episode. LeRobot reads the unpacked folder.

The ZIP file contains:

===================================== ==========================================================================
meta/info.json                        rate, and name, type and shape of each feature
meta/stats.json                       smallest, largest, mean and standard deviation of each feature, and quantiles
meta/tasks.parquet                    the task as a sentence, as the index of a pandas table
meta/episodes/.../file-000.parquet    length and place of the episode, with its statistics
data/.../file-000.parquet             one row for each sample
meta/origin.json                      origin of the samples; LeRobot ignores this file
===================================== ==========================================================================
"""

import io
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final
from zipfile import ZIP_DEFLATED, ZIP_STORED, ZipFile

import numpy as np
from arro3.core import Array, DataType, Field, Schema, Table, fixed_size_list_array, list_array
from arro3.io import write_parquet
from numpy.typing import NDArray

from kata.motion.axes import AXES

_VERSION: Final = "v3.0"
_DATA: Final = "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
_EPISODES: Final = "meta/episodes/chunk-000/file-000.parquet"
_FILES_IN_CHUNK: Final = 1000
_DATA_FILE_MB: Final = 100
_VIDEO_FILE_MB: Final = 200
"""The last three values are LeRobot's own defaults. An hour of samples at 100 Hz is one file."""
_QUANTILES: Final = {"q01": 0.01, "q10": 0.1, "q50": 0.5, "q90": 0.9, "q99": 0.99}
_MOTORS: Final = (
    ("observation.state", "measured_deg", "motor_{}_measured_deg"),
    ("observation.torque", "torque_nm", "motor_{}_torque_nm"),
    ("action", "setpoint_deg", "motor_{}_setpoint_deg"),
)
"""Feature, stored column, and name of each motor's value."""
_SCALARS: Final = (
    ("observation.phase", "phase", "int64"),
    ("observation.path_s", "path_s", "float64"),
    ("observation.time_s", "time_s", "float64"),
)
_FLOATS: Final = {"float32": DataType.float32(), "float64": DataType.float64(), "int64": DataType.int64()}


@dataclass(frozen=True)
class LeRobotEpisode:
    """Metadata of the dataset's only episode."""

    rate_hz: int
    task: str
    """A sentence about what the robot does."""
    robot: str
    origin: Mapping[str, str]


@dataclass(frozen=True)
class _Feature:
    name: str
    dtype: str
    values: NDArray[Any]
    """``(n,)`` or ``(n, k)``."""
    names: list[str] | None = None

    @property
    def shape(self) -> list[int]:
        return [self.values.shape[1] if self.values.ndim == 2 else 1]

    @property
    def described(self) -> dict[str, Any]:
        return {"dtype": self.dtype, "shape": self.shape, "names": self.names}

    @property
    def array(self) -> Array:
        flat = Array.from_numpy(np.ascontiguousarray(self.values).reshape(-1))
        return fixed_size_list_array(flat, self.shape[0]) if self.values.ndim == 2 else flat

    @property
    def field(self) -> Field:
        value = _FLOATS[self.dtype]
        return Field(self.name, DataType.list(value, self.shape[0]) if self.values.ndim == 2 else value, nullable=True)

    @property
    def stats(self) -> dict[str, list[float] | list[int]]:
        """Return the statistics of each column. A missing value does not count."""
        rows = self.values.reshape(len(self.values), -1).astype(np.float64)
        statistics = {
            "min": np.nanmin(rows, axis=0),
            "max": np.nanmax(rows, axis=0),
            "mean": np.nanmean(rows, axis=0),
            "std": np.nanstd(rows, axis=0),
        } | {name: np.nanquantile(rows, share, axis=0) for name, share in _QUANTILES.items()}
        return {name: values.tolist() for name, values in statistics.items()} | {"count": [len(rows)]}


def write_lerobot(samples: Mapping[str, NDArray[np.float64]], episode: LeRobotEpisode, path: Path) -> None:
    """Write the samples of a run. ``timestamp`` counts the samples at the run's rate, as LeRobot requires; ``observation.time_s`` is the
    measured time.
    """
    features = _features(samples, episode.rate_hz)
    count = len(samples["time_s"])
    stats = {feature.name: feature.stats for feature in features}
    with ZipFile(path, "w", ZIP_DEFLATED) as archive:

        def add_table(name: str, table: Table) -> None:
            archive.writestr(name, _parquet(table), ZIP_STORED)  # Parquet is already compressed.

        def add_json(name: str, content: object) -> None:
            archive.writestr(name, json.dumps(content, indent=4, ensure_ascii=False, allow_nan=False) + "\n")

        add_json("meta/info.json", _info(features, episode, count))
        add_json("meta/stats.json", stats)
        add_json("meta/origin.json", dict(episode.origin))
        add_table("meta/tasks.parquet", _tasks(episode.task))
        add_table(_EPISODES, _episodes(episode.task, count, stats))
        schema = Schema([feature.field for feature in features], metadata=dict(episode.origin))
        data = Table.from_arrays([feature.array for feature in features], schema=schema)
        add_table(_DATA.format(chunk_index=0, file_index=0), data)


def _features(samples: Mapping[str, NDArray[np.float64]], rate_hz: int) -> list[_Feature]:
    count = len(samples["time_s"])
    features = [
        _Feature(name, "float32", samples[column].astype(np.float32), [title.format(motor) for motor in AXES])
        for name, column, title in _MOTORS
    ]
    features += [
        _Feature(name, dtype, samples[column].astype(dtype))
        for name, column, dtype in _SCALARS
        # A run that ended during the approach has no position on the motion.
        if not np.all(np.isnan(samples[column]))
    ]
    number = np.arange(count)
    zeros = np.zeros(count, np.int64)
    return [
        *features,
        _Feature("timestamp", "float32", (number / rate_hz).astype(np.float32)),
        _Feature("frame_index", "int64", number),
        _Feature("episode_index", "int64", zeros),
        _Feature("index", "int64", number),
        _Feature("task_index", "int64", zeros),
    ]


def _info(features: list[_Feature], episode: LeRobotEpisode, count: int) -> dict[str, Any]:
    return {
        "codebase_version": _VERSION,
        "robot_type": episode.robot,
        "total_episodes": 1,
        "total_frames": count,
        "total_tasks": 1,
        "chunks_size": _FILES_IN_CHUNK,
        "data_files_size_in_mb": _DATA_FILE_MB,
        "video_files_size_in_mb": _VIDEO_FILE_MB,
        "fps": episode.rate_hz,
        "splits": {"train": "0:1"},
        "data_path": _DATA,
        "video_path": None,
        "features": {feature.name: feature.described for feature in features},
    }


def _tasks(task: str) -> Table:
    """Return the table of tasks. LeRobot reads it with pandas, which takes the name of the index from this metadata."""
    column = {
        "metadata": None,
        "numpy_type": "int64",
        "pandas_type": "int64",
        "name": "task_index",
        "field_name": "task_index",
    }
    index = column | {"numpy_type": "object", "pandas_type": "unicode", "name": "task", "field_name": "task"}
    pandas = {"index_columns": ["task"], "column_indexes": [], "columns": [column, index], "pandas_version": "2.0.0"}
    fields = [Field("task_index", DataType.int64(), nullable=True), Field("task", DataType.utf8(), nullable=True)]
    schema = Schema(fields, metadata={"pandas": json.dumps(pandas)})
    return Table.from_arrays([Array([0], DataType.int64()), Array([task], DataType.utf8())], schema=schema)


def _episodes(task: str, count: int, stats: Mapping[str, Mapping[str, list[float] | list[int]]]) -> Table:
    numbers = {
        "episode_index": 0,
        "length": count,
        "data/chunk_index": 0,
        "data/file_index": 0,
        "dataset_from_index": 0,
        "dataset_to_index": count,
        "meta/episodes/chunk_index": 0,
        "meta/episodes/file_index": 0,
    }
    columns: dict[str, Any] = {name: Array([number], DataType.int64()) for name, number in numbers.items()}
    columns["tasks"] = _one_list(Array([task], DataType.utf8()))
    for feature, statistics in stats.items():
        for name, values in statistics.items():
            kind = DataType.int64() if name == "count" else DataType.float64()
            columns[f"stats/{feature}/{name}"] = _one_list(Array(values, kind))
    return Table.from_pydict(columns)


def _one_list(values: Array) -> Array:
    """Return a column with one row, the list of these values."""
    return list_array(Array([0, len(values)], DataType.int32()), values)


def _parquet(table: Table) -> bytes:
    file = io.BytesIO()
    write_parquet(table, file, compression="snappy", created_by="Kata", max_row_group_size=1 << 16)
    return file.getvalue()
