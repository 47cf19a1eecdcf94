"""The journal of a teaching or a run: its format, writer, reader and folder lock."""

from kata.device.journal.folder import (
    FolderInUseError as FolderInUseError,
)
from kata.device.journal.folder import (
    claimed as claimed,
)
from kata.device.journal.format import (
    PHASE_APPROACHING as PHASE_APPROACHING,
)
from kata.device.journal.format import (
    PHASE_PAUSED as PHASE_PAUSED,
)
from kata.device.journal.format import (
    PHASE_PLAYING as PHASE_PLAYING,
)
from kata.device.journal.format import (
    PHASE_REDUCED_RANGE as PHASE_REDUCED_RANGE,
)
from kata.device.journal.format import (
    PHASE_RETURNING as PHASE_RETURNING,
)
from kata.device.journal.format import (
    PHASE_REVERSING as PHASE_REVERSING,
)
from kata.device.journal.format import (
    PHASE_STOPPING as PHASE_STOPPING,
)
from kata.device.journal.format import (
    SUFFIX as SUFFIX,
)
from kata.device.journal.format import (
    JournalEnd as JournalEnd,
)
from kata.device.journal.format import (
    JournalError as JournalError,
)
from kata.device.journal.format import (
    JournalHeader as JournalHeader,
)
from kata.device.journal.format import (
    Sample as Sample,
)
from kata.device.journal.reader import (
    Journal as Journal,
)
from kata.device.journal.reader import (
    parse as parse,
)
from kata.device.journal.reader import (
    read as read,
)
from kata.device.journal.reader import (
    synthetic_journal as synthetic_journal,
)
from kata.device.journal.writer import (
    JournalDisk as JournalDisk,
)
from kata.device.journal.writer import (
    JournalWriter as JournalWriter,
)
