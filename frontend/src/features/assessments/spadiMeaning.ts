import type { Schemas } from "../../lib/api/client";

type Limits = Pick<Schemas["AssessmentForm"], "spadi_mcid_lower" | "spadi_mcid_upper" | "spadi_mdc">;

/** Return the limits as the parameters of a text: smallest and largest MCID of the studies, and the measurement error. */
export const spadiLimits = (limits: Limits) => ({
  least: limits.spadi_mcid_lower,
  most: limits.spadi_mcid_upper,
  detectable: limits.spadi_mdc,
});

/**
 * Return what a shown change of the SPADI means; a lower score is better. A change may be important to patients, but within the
 * measurement error (perhaps).
 */
export function spadiMeaning(change: number, limits: Limits) {
  const size = Math.abs(change);
  if (size < limits.spadi_mcid_lower) return "unimportant";
  if (size <= limits.spadi_mdc) return change < 0 ? "perhapsBetter" : "perhapsWorse";
  return change < 0 ? "better" : "worse";
}
