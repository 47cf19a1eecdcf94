import { type SessionState, stepOf } from "./session-wizard/steps";

export const FIRST_STEPS = ["sign_up", "choose", "teach", "begin", "play", "look"] as const;
export type FirstStep = (typeof FIRST_STEPS)[number];

/** The data of the clinic and of the chosen patient that the guide needs. */
type Progress = {
  patients: number;
  chosen: boolean;
  recordings: number;
  session: SessionState | null;
};

/**
 * Return the next step for a new user. The step depends only on existing data, so that the user can work in any
 * order.
 */
export function firstStep({ patients, chosen, recordings, session }: Progress): FirstStep {
  if (patients === 0) return "sign_up";
  if (!chosen) return "choose";
  if (session?.runs.some((run) => run.ended_at)) return "look";
  if (recordings === 0) return "teach";
  return session && stepOf(session) === "play" ? "play" : "begin";
}
