import type { Schemas } from "../../lib/api/client";

export type Gains = Schemas["DriveGains"];

export const GAINS = ["p", "i", "d"] as const;

export const sameGains = (one: Gains, other: Gains) => GAINS.every((gain) => one[gain] === other[gain]);

/** Return true if the gains are outside the limits of the motor's next measurement. */
export const outsideLimits = (motor: Schemas["MotorTuning"], gains: Gains) =>
  GAINS.some((gain) => gains[gain] < motor.lowest[gain] || gains[gain] > motor.highest[gain]);

/** Return the numbers of the motors whose present gains differ from the former ones. */
export const changedMotors = (motors: Schemas["MotorTuning"][]) =>
  motors
    .filter((motor) => motor.former_gains && !sameGains(motor.former_gains, motor.gains))
    .map((motor) => motor.motor);
