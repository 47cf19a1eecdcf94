"""Import finished commissionings from the record files in the folder of the station's file.

Only ``kata commission`` and the page's procedure write these files. The service only reads them.
"""

import logging
from pathlib import Path

from kata.actor import by_program
from kata.clinic.commissionings import service
from kata.commissioning.record import RecordError, read_record, readable_record, record_path, record_paths
from kata.database.engine import Database

log = logging.getLogger(__name__)


def import_records(database: Database, station: str, station_file: Path) -> None:
    """Store every finished commissioning and check that the database lacks. Records that were changed are left out.

    The log names stored records that were changed in the database, or signed with another key than the present record's.
    """
    with by_program("import_commissioning", station), database.write() as session:
        for path in record_paths(station_file):
            try:
                record = read_record(path)
            except RecordError as error:
                log.warning("a commissioning record is not imported: %s", error)
                continue
            for finished in service.finished(record) if record else ():
                service.add(session, station, finished)
    present = readable_record(record_path(station_file))
    with database.read() as session:
        for problem in service.not_verified(session, station, present.public_key if present else ""):
            log.error("%s", problem)
