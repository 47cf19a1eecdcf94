"""The device process: the control thread, the bus, supervision and the journal.

The device stays safe without the service, and this package imports nothing from the service.
"""
