"""Records of commissionings and periodic checks."""
