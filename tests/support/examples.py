"""Numbers of examples of a property."""

from hypothesis import settings


def examples(*, few: int, many: int) -> settings:
    """Return the settings of a property: ``few`` examples in ``make test``, ``many`` in ``make campaign``.

    Both must reach every branch that only this property reaches: ``make test`` fails when one has no test.
    """
    return settings(max_examples=many if settings.get_current_profile_name() == "exploring" else few)
