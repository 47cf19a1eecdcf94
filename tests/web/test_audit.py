"""The trail of the real service: changes, looks, refusals and commands, each with who did it; and its search."""
