"""Pages that listen to the live state and confirm it, as a page's script does. Without this the service counts their browser as absent."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from fastapi import WebSocketDisconnect
from fastapi.testclient import TestClient


def shown_message(socket: Any) -> dict[str, Any]:
    """Receive a message of a page's WebSocket and confirm every second one."""
    message: dict[str, Any] = socket.receive_json()
    if message["sequence"] % 2 == 0:
        socket.send_json({"kind": "shown", "sequence": message["sequence"]})
    return message


@contextmanager
def open_page(client: TestClient) -> Iterator[None]:
    """Keep a page of the client's browser open during the block."""
    closing = threading.Event()
    with client.websocket_connect("/api/live") as socket:

        def show() -> None:
            while not closing.is_set():
                try:
                    shown_message(socket)
                except WebSocketDisconnect:
                    return

        showing = threading.Thread(target=show, name="open page")
        showing.start()
        try:
            yield
        finally:
            closing.set()
            showing.join()
