"""Figures for Plotly and the downsampling behind them."""
