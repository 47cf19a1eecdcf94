"""Who may do what."""

from typing import Final, Literal

from kata.access.actor import Role

Permission = Literal[
    "read_records",
    "write_records",
    "operate",
    "stop",
    "see_station",
    "diagnose",
    "administer",
    "own_account",
    "public",
]

OF_ROLE: Final[dict[Role, frozenset[Permission]]] = {
    "viewer": frozenset({"read_records", "see_station", "stop", "own_account", "public"}),
    "therapist": frozenset(
        {"read_records", "write_records", "operate", "stop", "see_station", "own_account", "public"}
    ),
    "administrator": frozenset(
        {
            "read_records",
            "write_records",
            "operate",
            "stop",
            "see_station",
            "diagnose",
            "administer",
            "own_account",
            "public",
        }
    ),
    "technician": frozenset({"see_station", "diagnose", "stop", "own_account", "public"}),
}
