/** The tabs of a session's page, in order. */
const SESSION_TABS = [
  "playback",
  "motion",
  "rhythm",
  "numbers",
  "goniometer",
  "plan",
  "compare",
  "record",
] as const;
export type SessionTab = (typeof SESSION_TABS)[number];
/** The open tab and the number of the chosen playback, from 1. */
export type SessionView = { tab?: SessionTab; run?: number };

/** Return the choices in an address. The defaults are the first tab and the first playback. */
export function readSessionView(search: Record<string, unknown>): SessionView {
  const tab = SESSION_TABS.find((name) => name === search.tab);
  const { run } = search;
  return {
    ...(tab && tab !== "playback" && { tab }),
    ...(typeof run === "number" && Number.isInteger(run) && run > 0 && { run }),
  };
}
