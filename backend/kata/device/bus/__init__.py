"""The RS-485 bus: one port behind which a driver for each servo protocol stands."""
