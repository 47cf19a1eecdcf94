import { formatClock } from "../../lib/format";
import { t } from "../../lib/i18n";
import { isAlive, type LiveState } from "../../lib/live/store";
import { translateServerText } from "../../lib/serverText";

/**
 * Priorities by IEC 60601-1-8, which depend on how soon a response is needed and how severe the harm without it
 * is.
 */
export type Priority = "high" | "medium" | "low";

/** An active alarm condition. */
export interface Alarm {
  /** Identifies the alarm. An alarm with a different code sounds even if the earlier ones are paused. */
  code: string;
  priority: Priority;
  message: string;
  nextStep: string;
}

const PRIORITY_ORDER: Priority[] = ["high", "medium", "low"];

/** Return the active alarms, most urgent first. */
export function activeAlarms(state: LiveState): Alarm[] {
  return [
    ...connectionAlarms(state),
    ...databaseAlarms(state),
    ...stopAlarms(state),
    ...apparatusAlarms(state),
  ].sort((a, b) => PRIORITY_ORDER.indexOf(a.priority) - PRIORITY_ORDER.indexOf(b.priority));
}

const alarm = (code: string, priority: Priority, message: string, nextStep: string): Alarm => ({
  code,
  priority,
  message,
  nextStep,
});

function connectionAlarms(state: LiveState): Alarm[] {
  const { live, connected, heardAt } = state;
  // Losing the state of motors that may have torque is worse than losing the state of motors without torque.
  const mayHold = live !== null && live.torque !== "off";
  const priority: Priority = mayHold ? "high" : "medium";
  if (!connected && heardAt !== null) {
    const next = mayHold ? t("alarms:texts.connectionLostTorqueNext") : t("alarms:texts.connectionLostNext");
    return [alarm("connection_lost", priority, t("alarms:texts.connectionLost"), next)];
  }
  const refused = live?.refusals.teach;
  if (connected && refused?.code === "commissioning_runs") {
    // Not a failure: the control program has handed the drives over.
    const message = translateServerText(refused.message, refused.message_key);
    const next = translateServerText(refused.next_step, refused.next_step_key);
    return [alarm("commissioning", "low", message, next)];
  }
  if (connected && !isAlive(state) && live !== null && live.device !== "starting") {
    const next = mayHold ? t("alarms:texts.deviceSilentTorqueNext") : t("alarms:texts.deviceSilentNext");
    return [alarm("device_silent", priority, t("alarms:texts.deviceSilent"), next)];
  }
  return [];
}

function databaseAlarms({ live, connected }: LiveState): Alarm[] {
  if (!connected || !live) return [];
  const { spool_full_since, unavailable_since } = live.database;
  if (spool_full_since) {
    const message = t("alarms:texts.spoolFull", { since: formatClock(new Date(spool_full_since)) });
    return [alarm("spool_full", "medium", message, t("alarms:texts.spoolFullNext"))];
  }
  if (unavailable_since) {
    const message = t("alarms:texts.databaseUnavailable", {
      since: formatClock(new Date(unavailable_since)),
    });
    return [alarm("database_away", "low", message, t("alarms:texts.databaseUnavailableNext"))];
  }
  return [];
}

/**
 * Return the alarm of a latched stop, coded by its first cause. Its priority is high while a cause is present
 * or the arm is held, and medium while it only waits to be acknowledged.
 */
function stopAlarms(state: LiveState): Alarm[] {
  const stop = state.live?.stop;
  const cause = stop?.causes[0];
  if (!stop || !cause) return [];
  const causePresent = stop.causes.some(({ cleared }) => !cleared);
  return [
    alarm(
      `stop ${cause.code}`,
      isAlive(state) && (stop.arm_held || causePresent) ? "high" : "medium",
      translateServerText(cause.message, cause.message_key),
      translateServerText(cause.next_step, cause.next_step_key),
    ),
  ];
}

function apparatusAlarms(state: LiveState): Alarm[] {
  const { live } = state;
  if (!isAlive(state) || live === null) return [];
  const alarms: Alarm[] = [];
  if (live.estop === "unknown" && !live.stop)
    alarms.push(
      alarm("estop_missing", "high", t("alarms:texts.estopMissing"), t("alarms:texts.estopMissingNext")),
    );
  if (live.lease?.unreachable_since && live.torque !== "off")
    alarms.push(
      alarm(
        "operator_unreachable",
        "medium",
        t("alarms:texts.browserLost"),
        t("alarms:texts.browserLostNext"),
      ),
    );
  if (live.teaching && live.pedal === "unknown")
    alarms.push(alarm("pedal_unknown", "low", t("alarms:texts.pedal"), t("alarms:texts.pedalNext")));
  if (live.run?.reversing && !live.stop) {
    const { resistance, resistance_key } = live.run;
    const message =
      resistance === null ? t("alarms:texts.reversing") : translateServerText(resistance, resistance_key);
    alarms.push(alarm("reversing", "low", message, t("alarms:texts.reversingNext")));
  }
  for (const warning of live.warnings)
    alarms.push(
      alarm(
        `${warning.code} ${warning.motor}`,
        "medium",
        translateServerText(warning.message, warning.message_key),
        translateServerText(warning.next_step, warning.next_step_key),
      ),
    );
  return alarms;
}
