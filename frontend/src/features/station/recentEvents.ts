import type { Schemas } from "../../lib/api/client";
import { t } from "../../lib/i18n";
import { translateServerText, withoutFullStop } from "../../lib/serverText";

type Event = Schemas["EventLive"];

/**
 * Return the events that are shown with their texts. Both lists begin with the newest event. The header shows the
 * mode; of the mode's events only the acknowledgement of a stop is shown.
 */
export function describeEvents(events: Event[]): { event: Event; text: string }[] {
  return events.flatMap((event, index) => {
    const text = event.code === "mode" ? describeAcknowledgement(events.slice(index)) : describeEvent(event);
    return text === null ? [] : [{ event, text }];
  });
}

/**
 * Return a text if the first event is the acknowledgement of a stop: it is the only way from stopped to idle. The
 * event numbers in between must be complete. A control program that restarts becomes idle, too, and counts from one.
 */
function describeAcknowledgement([idle, ...older]: Event[]): string | null {
  if (idle?.message !== "idle") return null;
  const before = older.findIndex((event) => event.code === "mode");
  if (older[before]?.message !== "stopped") return null;
  const complete = older.slice(0, before + 1).every((event, i) => event.number === idle.number - 1 - i);
  return complete ? t("station:events.acknowledged") : null;
}

function describeEvent({ code, message, message_key }: Event): string {
  const { fault, category } = (code === "fault" && message_key?.params) || {};
  if (typeof fault !== "object" || Array.isArray(fault) || typeof category !== "number")
    return translateServerText(message, message_key);
  return t("station:events.fault", {
    fault: withoutFullStop(translateServerText(fault.text, fault)),
    category,
  });
}
