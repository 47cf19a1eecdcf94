"""Puts it together: the app, its errors, the WebSocket, the page."""
