import { formatClock } from "../../lib/format";
import { isAlive, type LiveState } from "../../lib/live/store";
import { translateServerText } from "../../lib/serverText";
import { WORDS } from "./messages";

/** Priorities by IEC 60601-1-8: how soon a response is needed and how bad the harm without one. */
export type Priority = "high" | "medium" | "low";

/** An active alarm condition. */
export interface Alarm {
  /** A different code is a different alarm: it sounds even if the earlier ones are paused. */
  code: string;
  priority: Priority;
  message: string;
  nextStep: string;
}

const PRIORITY_ORDER: Priority[] = ["high", "medium", "low"];

/**
 * Return the active alarms, most urgent first. A latched stop is one alarm, coded by its first cause. It is
 * high while a cause is present or the arm is held, and medium when it only waits to be acknowledged.
 */
export function activeAlarms(state: LiveState): Alarm[] {
  const { live, connected, heardAt } = state;
  const alarms: Alarm[] = [];
  const raise = (code: string, priority: Priority, message: string, nextStep: string) =>
    alarms.push({ code, priority, message, nextStep });
  const alive = isAlive(state);
  // Losing sight of motors that may have torque is worse than losing sight of released ones.
  const unseen: Priority = live && live.torque !== "off" ? "high" : "medium";
  if (!connected && heardAt !== null)
    raise("connection_lost", unseen, WORDS.lost, unseen === "high" ? WORDS.lostHeldNext : WORDS.lostNext);
  if (connected && !alive && live !== null && live.device !== "starting") {
    raise(
      "device_silent",
      unseen,
      WORDS.restarting,
      unseen === "high" ? WORDS.restartingHeldNext : WORDS.restartingNext,
    );
  }
  const cause = live?.stop?.causes[0];
  if (connected && live?.database.spool_full_since) {
    raise(
      "not_kept",
      "medium",
      WORDS.notKept(formatClock(new Date(live.database.spool_full_since))),
      WORDS.notKeptNext,
    );
  } else if (connected && live?.database.unavailable_since) {
    const since = formatClock(new Date(live.database.unavailable_since));
    raise("database_away", "low", WORDS.databaseAway(since), WORDS.databaseAwayNext);
  }
  if (live?.stop && cause) {
    const causePresent = live.stop.causes.some((stopCause) => !stopCause.cleared);
    const priority = alive && (live.stop.arm_held || causePresent) ? "high" : "medium";
    raise(
      `stop ${cause.code}`,
      priority,
      translateServerText(cause.message, cause.message_key),
      translateServerText(cause.next_step, cause.next_step_key),
    );
  }
  if (alive && live !== null) {
    if (live.estop === "unknown" && !live.stop) {
      raise("estop_missing", "high", WORDS.estopMissing, WORDS.estopMissingNext);
    }
    if (live.lease?.unreachable_since && live.torque !== "off")
      raise("holder_away", "medium", WORDS.away, WORDS.awayNext);
    if (live.teaching && live.pedal === "unknown") {
      raise("pedal_unknown", "low", WORDS.pedal, WORDS.pedalNext);
    }
    if (live.run?.reversing && !live.stop) {
      raise(
        "reversing",
        "low",
        live.run.resistance === null
          ? WORDS.reversing
          : translateServerText(live.run.resistance, live.run.resistance_key),
        WORDS.reversingNext,
      );
    }
  }
  return alarms.sort((a, b) => PRIORITY_ORDER.indexOf(a.priority) - PRIORITY_ORDER.indexOf(b.priority));
}
