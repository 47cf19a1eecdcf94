import { expect, test } from "vitest";
import type { Schemas } from "../../lib/api/client";
import { actionChoices, describeAction, describeDetail, describeSubject } from "./describeAuditEntry";

const entry = (detail: Record<string, unknown>) => ({ detail }) as unknown as Schemas["AuditEntry"];

test("translates an action, and shows an unknown action's code", () => {
  expect(describeAction("lock_screen")).toBe("Screen locked");
  expect(describeAction("fly")).toBe("fly");
  expect(describeAction("constructor")).toBe("constructor");
});

test("sorts actions by text and includes the address's action", () => {
  const labels = actionChoices("fly").map(({ label }) => label);
  expect(labels).toEqual([...labels].sort((a, b) => a.localeCompare(b)));
  expect(labels).toContain("fly");
  expect(actionChoices(undefined)).toContainEqual({ value: "stop", label: "Stop" });
});

test("names the kinds in a subject, and keeps paths", () => {
  expect(describeSubject("session 0193 recording 0194")).toBe("session, recording");
  expect(describeSubject("GET /api/secret")).toBe("GET /api/secret");
  expect(describeSubject("")).toBe("");
  expect(describeSubject("station_versions Station 1 2")).toBe("station configuration");
});

test("explains a refusal by code or number, with its repetitions", () => {
  expect(describeDetail(entry({ why: "wrong_password", again: 4 }))).toEqual([
    "Reason: wrong user name or password",
    "Repeated 4 times, so numbered up to a minute after its time",
  ]);
  expect(describeDetail(entry({ why: 401 }))).toEqual(["Reason: not signed in"]);
});

test("names the identifiers that confirmed a patient", () => {
  expect(describeDetail(entry({ identity: "birth_date+name" }))).toEqual(["Identity: birth date, name"]);
});

test("lists changes by kind", () => {
  const changes = { added: { runs: ["a"], run_samples: 12 }, changed: { sessions: { b: ["note"] } } };
  expect(
    describeDetail(entry({ ...changes, removed: { stages: ["c"] }, changed_many: ["accounts"] })),
  ).toEqual([
    "Added: playback, samples of a playback",
    "Changed: session",
    "Changed: account",
    "Removed: stage",
  ]);
});
