import { expect, test } from "vitest";
import type { Schemas } from "../../lib/api/client";
import { actionChoices, actionOf, linesOf, subjectOf } from "./describeAuditEntry";

const entry = (detail: Record<string, unknown>) => ({ detail }) as unknown as Schemas["AuditEntry"];

test("an action is told in words, and one that nobody knows as it is", () => {
  expect(actionOf("lock_screen")).toBe("Screen locked");
  expect(actionOf("fly")).toBe("fly");
  expect(actionOf("constructor")).toBe("constructor");
});

test("actions are chosen by their words, in their order; what the address asks for is among them", () => {
  const labels = actionChoices("fly").map(({ label }) => label);
  expect(labels).toEqual([...labels].sort((one, other) => one.localeCompare(other)));
  expect(labels).toContain("fly");
  expect(actionChoices(undefined)).toContainEqual({ value: "stop", label: "Stop" });
});

test("what it was done to is told by its kind; a path at the door as it is", () => {
  expect(subjectOf("session 0193 recording 0194")).toBe("session, recording");
  expect(subjectOf("GET /api/secret")).toBe("GET /api/secret");
  expect(subjectOf("")).toBe("");
});

test("a refusal says why in words, by its code or by its number, and how often again", () => {
  expect(linesOf(entry({ why: "wrong_password", again: 4 }))).toEqual([
    "Because: wrong user name or password",
    "The same again: 4 times",
  ]);
  expect(linesOf(entry({ why: 401 }))).toEqual(["Because: nobody was signed in"]);
});

test("what changed is told by kinds of things", () => {
  const told = { added: { runs: ["a"], run_samples: 12 }, changed: { sessions: { b: ["note"] } } };
  expect(linesOf(entry({ ...told, removed: { stages: ["c"] }, changed_many: ["accounts"] }))).toEqual([
    "Added: run, samples of a run",
    "Changed: session",
    "Changed: account",
    "Removed: stage",
  ]);
});
