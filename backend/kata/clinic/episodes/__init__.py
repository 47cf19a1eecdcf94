"""Episodes of care: one shoulder, from referral to discharge."""
