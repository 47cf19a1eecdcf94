"""Limits on the messages of a WebSocket, and a list of users who exceeded them."""

import time
from collections import defaultdict, deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Final
from uuid import UUID

from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol
from websockets.frames import CloseCode

from kata.api.token_bucket import TokenBucket

MESSAGES_PER_S: Final = 10.0
"""Mean rate of messages of one WebSocket. A page confirms about three states a second and sends a Stop for each press."""
MESSAGES_AT_ONCE: Final = 40
"""Messages that one WebSocket may send at once, beyond the mean rate."""
BYTES_PER_S: Final = 2048.0
"""Mean rate of bytes of one WebSocket, including pings and pongs. A Stop has 50 bytes."""
BYTES_AT_ONCE: Final = 8192
"""Bytes that one WebSocket may send at once, beyond the mean rate."""
TOO_MANY: Final = "too many messages"
"""Reason in the closing frame."""
OFFENCES: Final = 3
"""After this many closed WebSockets within :data:`REFUSED_S`, further WebSockets of the same user at the same address are refused."""
REFUSED_S: Final = 60.0

Offender = tuple[UUID, str]
"""Account and address. The same user at another computer is not affected."""


@dataclass
class Offences:
    """Remembers users whose WebSockets were closed because of too many messages. They can still send a Stop by HTTP."""

    clock: Callable[[], float] = time.monotonic
    _at_s: dict[Offender, deque[float]] = field(default_factory=lambda: defaultdict(lambda: deque(maxlen=OFFENCES)))

    def add(self, offender: Offender) -> None:
        """Note that a WebSocket of this user was closed."""
        self._at_s[offender].append(self.clock())

    def is_refused(self, offender: Offender) -> bool:
        """Return True if the user's WebSockets are refused at present."""
        since_s = self.clock() - REFUSED_S
        for other in [other for other, at_s in self._at_s.items() if at_s[-1] < since_s]:
            del self._at_s[other]
        at_s = self._at_s.get(offender, deque())
        return len(at_s) == OFFENCES and at_s[0] >= since_s


class LimitedWebSocket(WebSocketsSansIOProtocol):
    """uvicorn's WebSocket protocol, which reads no more bytes than :class:`TokenBucket` permits and then closes the connection.

    uvicorn parses a whole read at once, up to 256 KiB, and continues for ten seconds after the application has closed the WebSocket.
    Thousands of short messages in one read would block the event loop and delay a Stop.
    """

    def __init__(self, *args: Any, **options: Any) -> None:
        """All arguments are uvicorn's."""
        super().__init__(*args, **options)
        self._bytes = TokenBucket(BYTES_PER_S, BYTES_AT_ONCE)

    def data_received(self, data: bytes) -> None:
        """Parse the bytes within the allowance, so that a Stop among them is processed. Close the connection if there are more bytes."""
        if not self.handshake_initiated:
            super().data_received(data)
            return
        allowed = self._bytes.take_some(len(data))
        super().data_received(data[:allowed])
        if allowed < len(data):
            self._end()

    def _end(self) -> None:
        if self.handshake_complete and not self.disconnected and not self.close_sent:
            disconnect: Any = {"type": "websocket.disconnect", "code": CloseCode.POLICY_VIOLATION, "flooded": True}
            self.queue.put_nowait(disconnect)
            self.conn.send_close(CloseCode.POLICY_VIOLATION, TOO_MANY)
            self.transport.write(b"".join(self.conn.data_to_send()))
            # When the application receives its next message, it learns that the client is disconnected.
            self.disconnected = True
        self.transport.close()
