import type { Schemas } from "../../lib/api/client";
import { totalAsShown } from "../../lib/format";

/** Decimals of the hours of a station's day or week. */
export const HOURS_DIGITS = 2;

/** Return the hours of all rows: the sum of the hours that the table shows, with one decimal. */
export const describeHours = (rows: Pick<Schemas["StationUse"], "hours">[]) =>
  totalAsShown(
    rows.map(({ hours }) => hours),
    HOURS_DIGITS,
  ).toFixed(1);
