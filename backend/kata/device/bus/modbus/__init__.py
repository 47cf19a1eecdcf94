"""The driver for Modbus RTU: frames, requests, bandwidth, and the bus."""
