"""Progress: what an episode's assessments and sessions have come to, week by week."""
