"""Scapulohumeral rhythm of recordings and runs, in angles of the apparatus's links."""
