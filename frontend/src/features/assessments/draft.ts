import type { Assessment, Schemas } from "../../lib/api/client";
import { formatDeg } from "../../lib/format";
import { measureName, ROM } from "./messages";
import type { Answers } from "./spadi";

type Measure = Schemas["RomMeasure"];
type Entry = Schemas["RomEntry"];
export type Side = Entry["side"];
export type Kind = Entry["kind"];

export const PAIN_NAMES = ["pain_rest", "pain_active", "pain_passive", "pain_average"] as const;
export type Pain = (typeof PAIN_NAMES)[number];

/** An assessment while it is being keyed in. */
export type Draft = {
  /** Local, as the browser's own field for it wants it. */
  at: string;
  by: string;
  /** What was typed, by `cell`. */
  rom: Record<string, string>;
  pains: Record<Pain, number | null>;
  spadi: Answers;
  note: string;
};

const SPADI_ITEMS = 13;

/** Which field of the grid. */
export const cell = (one: { side: Side; motion: string; position: string; kind: Kind }) =>
  [one.side, one.motion, one.position, one.kind].join(" ");

export function emptyDraft(now: Date, by: string): Draft {
  return {
    at: localMoment(now),
    by,
    rom: {},
    pains: { pain_rest: null, pain_active: null, pain_passive: null, pain_average: null },
    spadi: Array<null>(SPADI_ITEMS).fill(null),
    note: "",
  };
}

export function draftOf(one: Assessment): Draft {
  const { pain_rest, pain_active, pain_passive, pain_average } = one;
  return {
    at: localMoment(new Date(one.assessed_at)),
    by: one.assessed_by,
    rom: Object.fromEntries(one.rom.map((entry) => [cell(entry), String(entry.angle_deg)])),
    pains: { pain_rest, pain_active, pain_passive, pain_average },
    spadi: one.spadi ?? Array<null>(SPADI_ITEMS).fill(null),
    note: one.note,
  };
}

/** The number that was typed; null where none was, undefined where it is none. */
export function typedAngle(text: string): number | null | undefined {
  const plain = text.trim().replace(",", ".").replace("−", "-");
  if (plain === "") return null;
  const angle = Number(plain);
  return Number.isFinite(angle) ? angle : undefined;
}

/** What is wrong with what was typed, in a sentence; null where nothing is. */
export function angleProblem(measure: Measure, text: string): string | null {
  const angle = typedAngle(text);
  if (angle === null) return null;
  if (angle !== undefined && angle >= measure.lowest_deg && angle <= measure.highest_deg) return null;
  const [lowest, highest] = [formatDeg(measure.lowest_deg, 0), formatDeg(measure.highest_deg, 0)];
  return ROM.implausible(measureName(measure), lowest, highest);
}

/** As the service wants it. */
export function requestOf(draft: Draft, measures: Measure[]): Schemas["AssessmentCreate"] {
  const rom: Entry[] = [];
  for (const { motion, position } of measures) {
    for (const side of ["left", "right"] as const) {
      for (const kind of ["active", "passive"] as const) {
        const angle_deg = typedAngle(draft.rom[cell({ side, motion, position, kind })] ?? "");
        if (typeof angle_deg === "number") rom.push({ side, motion, position, kind, angle_deg });
      }
    }
  }
  return {
    assessed_at: new Date(draft.at).toISOString(),
    assessed_by: draft.by.trim(),
    rom,
    ...draft.pains,
    spadi: draft.spadi.some((answer) => answer !== null) ? draft.spadi : null,
    note: draft.note,
  };
}

/** The browser's own field for a moment knows no time zone: it is the one that the browser is in. */
function localMoment(moment: Date): string {
  const local = new Date(moment.getTime() - moment.getTimezoneOffset() * 60_000);
  return local.toISOString().slice(0, 16);
}
