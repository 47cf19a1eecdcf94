import { formatClock } from "../../lib/format";
import { t } from "../../lib/i18n";
import { isAlive, type LiveState } from "../../lib/live/store";
import { translateServerText } from "../../lib/serverText";

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
    raise(
      "connection_lost",
      unseen,
      t("alarms:texts.connectionLost"),
      unseen === "high" ? t("alarms:texts.connectionLostTorqueNext") : t("alarms:texts.connectionLostNext"),
    );
  if (connected && !alive && live !== null && live.device !== "starting") {
    raise(
      "device_silent",
      unseen,
      t("alarms:texts.deviceSilent"),
      unseen === "high" ? t("alarms:texts.deviceSilentTorqueNext") : t("alarms:texts.deviceSilentNext"),
    );
  }
  const cause = live?.stop?.causes[0];
  if (connected && live?.database.spool_full_since) {
    raise(
      "not_kept",
      "medium",
      t("alarms:texts.spoolFull", { since: formatClock(new Date(live.database.spool_full_since)) }),
      t("alarms:texts.spoolFullNext"),
    );
  } else if (connected && live?.database.unavailable_since) {
    const since = formatClock(new Date(live.database.unavailable_since));
    raise(
      "database_away",
      "low",
      t("alarms:texts.databaseUnavailable", { since }),
      t("alarms:texts.databaseUnavailableNext"),
    );
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
      raise("estop_missing", "high", t("alarms:texts.estopMissing"), t("alarms:texts.estopMissingNext"));
    }
    if (live.lease?.unreachable_since && live.torque !== "off")
      raise("holder_away", "medium", t("alarms:texts.browserLost"), t("alarms:texts.browserLostNext"));
    if (live.teaching && live.pedal === "unknown") {
      raise("pedal_unknown", "low", t("alarms:texts.pedal"), t("alarms:texts.pedalNext"));
    }
    if (live.run?.reversing && !live.stop) {
      raise(
        "reversing",
        "low",
        live.run.resistance === null
          ? t("alarms:texts.reversing")
          : translateServerText(live.run.resistance, live.run.resistance_key),
        t("alarms:texts.reversingNext"),
      );
    }
  }
  return alarms.sort((a, b) => PRIORITY_ORDER.indexOf(a.priority) - PRIORITY_ORDER.indexOf(b.priority));
}
