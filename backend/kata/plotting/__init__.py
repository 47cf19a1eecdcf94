"""Builds figures for Plotly, and downsamples their data."""
