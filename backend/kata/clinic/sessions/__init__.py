"""Sessions: visits, and the runs in them."""
