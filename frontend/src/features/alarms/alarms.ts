import { formatClock } from "../../lib/format";
import { isAlive, type LiveState } from "../../lib/live/store";
import { translateServerText } from "../../lib/serverText";
import { WORDS } from "./messages";

/** As IEC 60601-1-8 means them: how soon somebody has to do something, and how bad it is if nobody does. */
export type Priority = "high" | "medium" | "low";

/** One condition that somebody has to know of. */
export interface Alarm {
  /** Another code is another alarm, which sounds although the sound of those before was paused. */
  code: string;
  priority: Priority;
  message: string;
  nextStep: string;
}

const ORDER: Priority[] = ["high", "medium", "low"];

/**
 * What holds now, most urgent first. A latched stop is one alarm, by its first cause: high while it holds an arm or a cause stands,
 * medium once it only waits to be acknowledged.
 */
export function alarmsOf(state: LiveState): Alarm[] {
  const { live, connected, heardAt } = state;
  const found: Alarm[] = [];
  const note = (code: string, priority: Priority, message: string, nextStep: string) =>
    found.push({ code, priority, message, nextStep });
  const alive = isAlive(state);
  // What may still move an arm, unseen, is worse than what only cannot be seen.
  const unseen: Priority = live && live.torque !== "off" ? "high" : "medium";
  if (!connected && heardAt !== null)
    note("connection_lost", unseen, WORDS.lost, unseen === "high" ? WORDS.lostHeldNext : WORDS.lostNext);
  if (connected && !alive && live !== null && live.device !== "starting") {
    note(
      "device_silent",
      unseen,
      WORDS.restarting,
      unseen === "high" ? WORDS.restartingHeldNext : WORDS.restartingNext,
    );
  }
  const cause = live?.stop?.causes[0];
  if (connected && live?.database.spool_full_since) {
    note(
      "not_kept",
      "medium",
      WORDS.notKept(formatClock(new Date(live.database.spool_full_since))),
      WORDS.notKeptNext,
    );
  } else if (connected && live?.database.unavailable_since) {
    const since = formatClock(new Date(live.database.unavailable_since));
    note("database_away", "low", WORDS.databaseAway(since), WORDS.databaseAwayNext);
  }
  if (live?.stop && cause) {
    const stands = live.stop.causes.some((one) => !one.cleared);
    const priority = alive && (live.stop.arm_held || stands) ? "high" : "medium";
    note(
      `stop ${cause.code}`,
      priority,
      translateServerText(cause.message, cause.message_key),
      translateServerText(cause.next_step, cause.next_step_key),
    );
  }
  if (alive && live !== null) {
    if (live.estop === "unknown" && !live.stop) {
      note("estop_missing", "high", WORDS.estopMissing, WORDS.estopMissingNext);
    }
    if (live.lease?.unreachable_since && live.torque !== "off")
      note("holder_away", "medium", WORDS.away, WORDS.awayNext);
    if (live.teaching && live.pedal === "unknown") {
      note("pedal_unknown", "low", WORDS.pedal, WORDS.pedalNext);
    }
    if (live.run?.reversing && !live.stop) {
      note(
        "reversing",
        "low",
        live.run.resistance === null
          ? WORDS.reversing
          : translateServerText(live.run.resistance, live.run.resistance_key),
        WORDS.reversingNext,
      );
    }
  }
  return found.sort((a, b) => ORDER.indexOf(a.priority) - ORDER.indexOf(b.priority));
}
