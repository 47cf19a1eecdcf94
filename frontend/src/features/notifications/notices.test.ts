import { expect, it } from "vitest";
import type { Schemas } from "../../lib/api/client";
import { toNotice } from "./notices";

const notification = (part: Partial<Schemas["Notification"]>): Schemas["Notification"] => ({
  id: "n",
  at: "2026-11-25T09:00:00Z",
  kind: "alarm",
  name: "",
  problem: "",
  station: "",
  code: "",
  patient_id: null,
  session_id: null,
  read: false,
  ...part,
});

it("leads each notification to the page behind it", () => {
  const targets = [
    notification({ kind: "erasure", patient_id: "p" }),
    notification({ kind: "emergency_access", name: "Sato" }),
    notification({ kind: "failed_backup", problem: "Disk full." }),
    notification({ kind: "unrestorable_backup", problem: "A table is missing." }),
    notification({ kind: "alarm", session_id: "s" }),
    notification({ kind: "alarm" }),
  ].map((notice) => toNotice(notice).target);
  expect(targets).toEqual([
    { to: "/patients/p", search: { tab: "data" } },
    { to: "/administration/emergency-access" },
    { to: "/administration/backups" },
    { to: "/administration/backups" },
    { to: "/sessions/s" },
    { to: "/stations" },
  ]);
});

it("names the station and the cause of an alarm", () => {
  const alarm = notification({ station: "Kata 1", code: "estop_pressed" });
  expect(toNotice(alarm).words).toBe("Kata 1: Emergency stop pressed");
});
