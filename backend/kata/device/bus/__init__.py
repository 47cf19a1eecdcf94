"""The RS-485 bus: the interface of a bus, and a driver for each servo protocol."""
