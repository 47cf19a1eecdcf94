"""The device process: the control thread, the bus, supervision and the journal.

It needs nothing of the service to be safe, and imports nothing of it.
"""
