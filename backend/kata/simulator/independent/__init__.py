"""Simulates the independent plant: apparatus and patient as a MuJoCo model. MuJoCo is imported only when this plant is created."""
