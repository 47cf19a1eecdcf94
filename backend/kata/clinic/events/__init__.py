"""What happened on the apparatus: alarms and events, kept for whoever asks later; and the stations themselves."""
