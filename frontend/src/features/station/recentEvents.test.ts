import { expect, it } from "vitest";
import type { Schemas } from "../../lib/api/client";
import { describeEvents } from "./recentEvents";

type Event = Schemas["EventLive"];

const event = (number: number, code: string, message: string): Event => ({
  number,
  code,
  message,
  at: `2026-03-01T09:00:${String(number).padStart(2, "0")}Z`,
});
const fault: Event = {
  ...event(1, "fault", "The emergency stop was pressed. (stop category 0)"),
  message_key: {
    code: "fault_event",
    params: {
      fault: { code: "estop_pressed", text: "The emergency stop was pressed.", params: {} },
      category: 0,
    },
  },
};
/** Return the shown texts, oldest first. */
const texts = (...oldestFirst: Event[]) =>
  describeEvents(oldestFirst.toReversed())
    .map(({ text }) => text)
    .toReversed();

it("shows the acknowledgement between a stop and the next torque", () => {
  expect(
    texts(
      fault,
      event(2, "mode", "stopped"),
      event(3, "torque", "Torque is being switched off."),
      event(4, "mode", "idle"),
      event(5, "mode", "ready"),
      event(6, "torque", "Torque is on."),
    ),
  ).toEqual([
    "The emergency stop was pressed (stop category 0).",
    "Torque is being switched off.",
    "The stop was acknowledged.",
    "Torque is on.",
  ]);
});

it("shows no acknowledgement after a return", () => {
  expect(texts(event(1, "mode", "returning"), event(2, "mode", "idle"))).toEqual([]);
});

it("takes no restarted control program for an acknowledgement", () => {
  expect(texts(event(7, "mode", "stopped"), event(1, "mode", "idle"))).toEqual([]);
});

it("claims no acknowledgement when events between are missing", () => {
  expect(texts(event(7, "mode", "stopped"), event(11, "mode", "idle"))).toEqual([]);
});

it("shows a fault without a key as it was sent", () => {
  expect(texts(event(1, "fault", "Something stopped."))).toEqual(["Something stopped."]);
});
