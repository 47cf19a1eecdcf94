"""Models of the clinic's own data."""

from typing import Annotated, Final

from pydantic import Field, StringConstraints

from kata.types import NO_NUL, Moment, Schema

_LINE: Final = r"^[^\x00-\x1f\x7f]*$"
_Line = Annotated[str, StringConstraints(strip_whitespace=True, max_length=200, pattern=_LINE)]


class ClinicProfileUpdate(Schema):
    """The head of printed reports, and the clinic's time zone."""

    name: _Line = Field(examples=["Sakura Clinic"])
    address: Annotated[str, StringConstraints(strip_whitespace=True, max_length=1000, pattern=NO_NUL)] = Field(
        description="Lines of the address.", examples=["1-2-3 Honcho\nTokyo"]
    )
    phone: Annotated[str, StringConstraints(strip_whitespace=True, max_length=50, pattern=_LINE)] = Field(
        examples=["03-0000-0000"]
    )
    time_zone: Annotated[str, StringConstraints(max_length=64, pattern=_LINE)] = Field(
        description="IANA name of the zone in which every day and time is stated.",
        examples=["Asia/Tokyo"],
    )


class ClinicProfile(Schema):
    """The clinic's data as reports use them."""

    name: str
    address: str = Field(description="Lines of the address.")
    phone: str
    time_zone: str = Field(description="IANA name; empty: none is set, and every day and time is of UTC.")
    has_logo: bool = Field(description="True if reports have the logo of KATA_CLINIC_LOGO.")
    updated_at: Moment | None = Field(
        description="Time of the last change; null: the values are those of the service's settings."
    )
    updated_by: str = Field(
        description="Name of the administrator who made the last change; empty before the first change."
    )
