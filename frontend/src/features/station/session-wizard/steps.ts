import type { Schemas, Session } from "../../../lib/api/client";

export const STEPS = ["begin", "checklist", "pain_before", "play", "pain_after", "note"] as const;
export type Step = (typeof STEPS)[number];

/** The part of a session that determines its step. */
export type SessionState = Pick<
  Session,
  "ended_at" | "checks" | "pain_before" | "pain_during" | "pain_after" | "runs"
>;

/**
 * Return the session's current step from its record, so that a reload or another computer continues at that
 * step.
 */
export function stepOf(session: SessionState | null): Step {
  if (session === null) return "begin";
  if (session.ended_at) return "note";
  if (session.pain_after !== null) return "note";
  if (session.pain_during !== null) return "pain_after";
  if (session.runs.length > 0) return "play";
  if (
    !["identity", "side", "fixtures", "belt"].every((name) =>
      session.checks.some(({ check }) => check === name),
    )
  ) {
    return "checklist";
  }
  return session.pain_before === null ? "pain_before" : "play";
}

/**
 * Return how many steps are done. A motion that is loaded has passed the steps before playing, also if they were done on
 * another screen and the session's record is not fetched again yet.
 */
export const stepsDone = (session: SessionState | null, isLoaded: boolean): number =>
  Math.max(STEPS.indexOf(stepOf(session)), isLoaded ? STEPS.indexOf("play") : 0);

/**
 * Return true if the step can be opened. Before the session only the first step can be opened, after its end
 * only the note.
 */
export function canGoTo(step: Step, session: SessionState | null): boolean {
  if (session === null) return step === "begin";
  return session.ended_at ? step === "note" : true;
}

export const stepAfter = (step: Step): Step =>
  STEPS[Math.min(STEPS.indexOf(step) + 1, STEPS.length - 1)] ?? step;

export type Item = Schemas["SessionItem"];
type Played = Pick<Schemas["Run"], "programme_position" | "outcome">;

/** True if a run completed the item. */
export const isDone = (item: Pick<Item, "position">, runs: Played[]): boolean =>
  runs.some((run) => run.programme_position === item.position && run.outcome === "completed");

/** Return the next planned item, or null if all are done. */
export const nextItem = (items: Item[], runs: Played[]): Item | null =>
  items.find((item) => !isDone(item, runs)) ?? null;
