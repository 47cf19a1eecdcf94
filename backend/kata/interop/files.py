"""File downloads. A file is written to disk before it is sent, so that no response is held in memory, and deleted afterwards."""

import os
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import BinaryIO, Final

from fastapi.responses import StreamingResponse

_CHUNK_BYTES: Final = 1 << 18


def file_response(write: Callable[[Path], None], media_type: str, name: str) -> StreamingResponse:
    """Return a streamed response with the file that ``write`` writes. ``name``: name of the downloaded file."""
    file = _temporary_file(write)
    headers = {
        "Content-Disposition": f'attachment; filename="{name}"',
        "Content-Length": str(os.fstat(file.fileno()).st_size),
    }
    return StreamingResponse(chunks(file), media_type=media_type, headers=headers)


def chunks(file: BinaryIO) -> Iterator[bytes]:
    """Yield a file in chunks and close it at its end."""
    with file:
        while chunk := file.read(_CHUNK_BYTES):
            yield chunk


def _temporary_file(write: Callable[[Path], None]) -> BinaryIO:
    handle, name = tempfile.mkstemp(prefix="kata-")
    os.close(handle)
    path = Path(name)
    try:
        write(path)
        return path.open("rb")
    finally:
        # The open handle stays readable. An aborted download leaves no file behind.
        path.unlink()
