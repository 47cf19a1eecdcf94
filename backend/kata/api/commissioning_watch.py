"""Follow the commissioning record in the folder of the station's file while the service runs."""

import logging
from collections.abc import Callable
from pathlib import Path

from kata.clinic.commissionings.importer import import_records
from kata.commissioning import texts
from kata.commissioning.record import record_paths
from kata.commissioning.status import CommissioningStatus, commissioning_status
from kata.database.engine import Database
from kata.device.config import StationConfig
from kata.device.ipc_messages import Refusal

log = logging.getLogger(__name__)


class CommissioningWatch:
    """Imports finished commissioning records, and knows whether the station is commissioned with the configuration in use."""

    def __init__(
        self, database: Database, config: StationConfig, station_file: Path | None, *, simulated: bool
    ) -> None:
        """``config``: the configuration in ``station_file``. A simulated apparatus needs no commissioning; its records are still
        imported.
        """
        self._database, self._config, self._file = database, config, station_file
        self._simulated = simulated
        self._seen: object = None
        """Configuration and versions of the files that the last complete check has used."""
        self.status = self._evaluate(config)
        self.on_change: Callable[[Refusal | None], None] = lambda refusal: None

    @property
    def refusal(self) -> Refusal | None:
        """Return why the station refuses patients, or None if it does not."""
        if self.status is None or self.status.missing is None:
            return None
        return Refusal.of(
            code="not_commissioned",
            message=texts.NOT_COMMISSIONED(reason=self.status.missing),
            next_step=texts.RUN_COMMISSION(),
        )

    def use(self, config: StationConfig) -> None:
        """Evaluate the record against another configuration from now on. Call it from any thread, also during a check."""
        self._config = config

    def check(self) -> None:
        """Evaluate and import the records if a file or the configuration has changed since the last call. Call it from one thread, at any interval.

        :raises DatabaseUnavailableError: when the database does not answer. The next call imports the records.
        """
        if self._file is None:
            return
        config = self._config
        files = [(path, path.stat().st_mtime_ns, path.stat().st_size) for path in record_paths(self._file)]
        if (config, files) == self._seen:
            return
        self.status = self._evaluate(config)
        self.on_change(self.refusal)
        import_records(self._database, config.name, self._file)
        self._seen = config, files

    def _evaluate(self, config: StationConfig) -> CommissioningStatus | None:
        """Return the commissioning status; None if no commissioning is needed."""
        if self._simulated or self._file is None:
            return None
        status = commissioning_status(self._file, config)
        if status.missing is not None:
            log.error("the station is not commissioned: %s; no patient can be treated", status.missing)
        return status
