import "./catalogue";
import type { Schemas } from "../../lib/api/client";
import { t } from "../../lib/i18n";
import { describeStop } from "../sessions/describeStop";

/** Something that the user should know, with a link to the page behind it. `at` is in UTC. */
export interface Notice {
  id: string;
  at: string;
  read: boolean;
  words: string;
  target: { to: string; search?: Record<string, string> };
}

/** Return a notification of the service as a notice in words. */
export function toNotice(notification: Schemas["Notification"]): Notice {
  const { id, at, read } = notification;
  return { id, at, read, ...wordsAndTarget(notification) };
}

function wordsAndTarget(notification: Schemas["Notification"]): Pick<Notice, "words" | "target"> {
  switch (notification.kind) {
    case "erasure":
      return {
        words: t("notifications:kinds.erasure"),
        target: { to: `/patients/${notification.patient_id}`, search: { tab: "data" } },
      };
    case "emergency_access":
      return {
        words: t("notifications:kinds.access", { name: notification.name }),
        target: { to: "/administration/emergency-access" },
      };
    case "failed_backup":
      return {
        words: t("notifications:kinds.backup", { problem: notification.problem }),
        target: { to: "/administration/backups" },
      };
    case "unrestorable_backup":
      return {
        words: t("notifications:kinds.unrestorable", { problem: notification.problem }),
        target: { to: "/administration/backups" },
      };
    case "alarm":
      return {
        words: t("notifications:kinds.alarm", {
          station: notification.station,
          cause: describeStop(notification.code),
        }),
        target: { to: notification.session_id ? `/sessions/${notification.session_id}` : "/stations" },
      };
  }
}
