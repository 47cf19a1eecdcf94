"""Progress charts of an episode, week by week."""
