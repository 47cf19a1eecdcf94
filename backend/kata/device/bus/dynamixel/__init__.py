"""The driver for Dynamixel Protocol 2.0: packets, requests, registers, bandwidth, and the bus."""
