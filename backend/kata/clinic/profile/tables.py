"""Table of the clinic's own data."""

from datetime import datetime
from typing import Final

from sqlalchemy import String, Text
from sqlalchemy.orm import Mapped, mapped_column

from kata.database.base import Base, UtcDateTime

THE_CLINIC: Final = 1
"""Id of the only row."""


class ClinicProfileRow(Base):
    """The values that an administrator has set on the page. Without this row, the service's settings apply.

    The first start without a time zone stores only the computer's zone: ``updated_by`` is empty, and the other values are not used.
    """

    __tablename__ = "clinic_profile"

    id: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    name: Mapped[str] = mapped_column(String(200))
    address: Mapped[str] = mapped_column(Text)
    """Address, one line of text per line."""
    phone: Mapped[str] = mapped_column(String(50))
    time_zone: Mapped[str] = mapped_column(String(64))
    """IANA name; empty: none is set, and days are those of UTC."""
    updated_at: Mapped[datetime] = mapped_column(UtcDateTime)
    updated_by: Mapped[str] = mapped_column(String(100))
