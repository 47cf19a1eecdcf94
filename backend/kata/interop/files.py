"""Files on their way out: written to the disk first, so that no answer is held in memory, and gone once they are sent."""

import os
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import BinaryIO, Final

from fastapi.responses import StreamingResponse

_PIECE: Final = 1 << 18


def file_response(write: Callable[[Path], None], media_type: str, name: str) -> StreamingResponse:
    """What ``write`` writes to the path it is given, as an answer in pieces, to be saved under a name."""
    file = _written(write)
    headers = {
        "Content-Disposition": f'attachment; filename="{name}"',
        "Content-Length": str(os.fstat(file.fileno()).st_size),
    }
    return StreamingResponse(pieces(file), media_type=media_type, headers=headers)


def pieces(file: BinaryIO) -> Iterator[bytes]:
    """A file from its beginning, and closed at its end."""
    with file:
        while piece := file.read(_PIECE):
            yield piece


def _written(write: Callable[[Path], None]) -> BinaryIO:
    handle, name = tempfile.mkstemp(prefix="kata-")
    os.close(handle)
    path = Path(name)
    try:
        write(path)
        return path.open("rb")
    finally:
        # Whoever has it open still reads it; nobody who breaks off leaves it behind.
        path.unlink()
