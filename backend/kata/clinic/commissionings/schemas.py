"""Responses about commissionings."""

from datetime import datetime
from typing import Literal
from uuid import UUID

from pydantic import Field

from kata.station.schemas import OptionalKey
from kata.types import Motor, Schema

CommissioningKind = Literal["full", "check"]


class MotorCondition(Schema):
    """Measured figures of one motor that show drift. Null: the commissioning or check did not measure the figure."""

    motor: Motor
    friction_deg: float | None = Field(
        None, description="Difference between setpoint and angle at which the motor begins to move."
    )
    play_deg: float | None = Field(None, description="Play of the gear. Only a full commissioning measures it.")
    lag_s: float | None = Field(None, description="Delay of the motor behind its setpoint, s.")
    temperature_c: float | None = None
    voltage_v: float | None = None
    damaged_answers_percent: float | None = Field(
        None, description="Share of the answers on the bus that arrived damaged."
    )


class Commissioning(Schema):
    """A finished commissioning or periodic check."""

    id: UUID
    station: str
    kind: CommissioningKind
    done_by: str
    software: str = Field(description="Version of Kata that began the record.", examples=["0.1.0"])
    began_at: datetime
    ended_at: datetime
    passed: bool
    fault: str = Field(description="Fault of the step that failed; empty if all steps passed.")
    fault_key: OptionalKey = None
    configuration_digest: str = Field(description="SHA-256 of the configuration.")
    digest: str = Field(description="SHA-256 of the record.")
    figures: list[MotorCondition]


class CommissioningValue(Schema):
    """A value before and after a step."""

    name: str
    motor: int = Field(ge=0, le=5, description="Motor number; 0: the value belongs to the station.")
    before: float | str | None
    after: float | str | None


class MotorStepResponse(Schema):
    """Response of a motor to a step of its setpoint."""

    motor: Motor
    load: Literal["weight", "empty"]
    step_deg: float = Field(description="Height of the step.")
    p_gain: int
    i_gain: int
    d_gain: int
    times_s: list[float] = Field(description="Times since the step, seconds.")
    angles_deg: list[float] = Field(description="Angles relative to the angle before the step.")


class CommissioningStepRun(Schema):
    """One run of a step."""

    step: str = Field(examples=["registers"])
    began_at: datetime
    ended_at: datetime
    passed: bool
    fault: str
    fault_key: OptionalKey = None
    values: list[CommissioningValue]
    curves: list[MotorStepResponse]


class CommissioningSignature(Schema):
    """Result of the verification of a record's signature."""

    state: Literal["valid", "changed", "unsigned"] = Field(
        description="valid: as the station signed it. changed: record or columns were changed afterwards. unsigned: written by an earlier release."
    )
    changed: list[str] = Field(description="Changed columns of the database. record: the record itself was changed.")
    public_key: str = Field(description="Public key of the station (Ed25519, hexadecimal); empty: not signed.")


class CommissioningDetail(Commissioning):
    """A commissioning or check with its steps."""

    signature: CommissioningSignature
    steps: list[CommissioningStepRun]
