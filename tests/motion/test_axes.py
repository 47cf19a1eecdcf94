"""Table 2."""

from kata.motion.axes import BASIC_MOTIONS, POSE_RANGE_DEG


def test_apparatus_reaches_the_reference_where_the_paper_does() -> None:
    reached = [
        motion.number
        for motion in BASIC_MOTIONS
        if motion.range_deg[0] <= motion.reference_deg[0] and motion.reference_deg[1] <= motion.range_deg[1]
    ]
    assert reached == [1, 2, 6]


def test_pose_limits_contain_every_motion_that_needs_the_angle() -> None:
    for axis, (low, high) in enumerate(POSE_RANGE_DEG, start=1):
        ranges = [motion.range_deg for motion in BASIC_MOTIONS if motion.axis == axis]
        assert (low, high) == (min(r[0] for r in ranges), max(r[1] for r in ranges))
