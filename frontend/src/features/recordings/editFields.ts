import "./catalogue";
import type { Edit } from "../../lib/api/client";
import { t } from "../../lib/i18n";
import type { Steps } from "../../ui/Stepper";
import { type Part, toTenth } from "./retouch";

export type EditType = Edit["do"];
export type FieldName =
  | "start_s"
  | "end_s"
  | "at_s"
  | "hold_s"
  | "percent"
  | "less_deg"
  | "step_deg"
  | "pause_s"
  | "further_deg"
  | "back_deg";
export type Field = Steps & { name: FieldName; initial: number };
type Entered = Partial<Record<FieldName, number>>;

export const MOTORS = [1, 2, 3, 4, 5];
export const EDIT_TYPES: EditType[] = [
  "trim",
  "hold",
  "scale",
  "retouch",
  "reteach",
  "guide",
  "isolate",
  "warm_up",
  "stretch",
  "mirror",
];
const SHORTEST_S = 0.5;

const seconds = (step: number) => ({ unit: t("recordings:edit.seconds"), step });
const degrees = (step: number) => ({ unit: t("recordings:edit.deg"), step });

/** The fields of a part between two times. */
const part = (end_s: number, entered: Entered, initial: { start_s: number; end_s: number }): Field[] => [
  {
    ...seconds(0.5),
    name: "start_s",
    label: t("recordings:edit.from"),
    min: 0,
    max: Math.max(0, (entered.end_s ?? initial.end_s) - SHORTEST_S),
    initial: toTenth(initial.start_s),
  },
  {
    ...seconds(0.5),
    name: "end_s",
    label: t("recordings:edit.to"),
    min: (entered.start_s ?? toTenth(initial.start_s)) + SHORTEST_S,
    max: end_s,
    initial: toTenth(initial.end_s),
  },
];

/** The fields of each edit. The bounds are the service's. `end_s` is the end of the recording. */
const FIELDS: Record<EditType, (end_s: number, entered: Entered) => Field[]> = {
  trim: (end_s, entered) => part(end_s, entered, { start_s: 0, end_s }),
  hold: (end_s) => [
    {
      ...seconds(0.5),
      name: "at_s",
      label: t("recordings:edit.at"),
      min: 0,
      max: end_s,
      initial: Math.floor(end_s) / 2,
    },
    { ...seconds(1), name: "hold_s", label: t("recordings:edit.duration"), min: 1, max: 600, initial: 5 },
  ],
  scale: () => [
    {
      name: "percent",
      label: t("recordings:edit.range"),
      unit: t("recordings:edit.percent"),
      step: 5,
      min: 10,
      max: 95,
      initial: 80,
    },
  ],
  isolate: () => [],
  warm_up: () => [
    { ...degrees(1), name: "less_deg", label: t("recordings:edit.lessBy"), min: 1, max: 180, initial: 15 },
    { ...degrees(0.5), name: "step_deg", label: t("recordings:edit.widerBy"), min: 0.5, max: 30, initial: 3 },
    { ...seconds(1), name: "pause_s", label: t("recordings:edit.pause"), min: 0, max: 120, initial: 0 },
  ],
  stretch: () => [
    { ...degrees(1), name: "further_deg", label: t("recordings:edit.further"), min: 0, max: 15, initial: 3 },
    { ...degrees(1), name: "back_deg", label: t("recordings:edit.back"), min: 1, max: 30, initial: 5 },
    { ...seconds(1), name: "hold_s", label: t("recordings:edit.hold"), min: 0, max: 120, initial: 10 },
  ],
  mirror: () => [],
  guide: () => [],
  reteach: (end_s, entered) => part(end_s, entered, { start_s: end_s / 4, end_s: (3 * end_s) / 4 }),
  // Its editor has its own fields.
  retouch: () => [],
};

/** Return the fields for an edit of a recording. The entered numbers limit each other. */
export const fieldsOf = (type: EditType, duration_s: number, entered: Entered): Field[] =>
  FIELDS[type](Math.floor(duration_s * 10) / 10, entered);

/** Return the edit for the service. `part` belongs to a retouch, `newPart` is the recording of a reteach. */
export function toEdit(
  type: EditType,
  number: (name: FieldName) => number,
  { motors, part, newPart }: { motors: number[]; part: Part; newPart: string | null },
): Edit {
  switch (type) {
    case "trim":
      return { do: type, start_s: number("start_s"), end_s: number("end_s") };
    case "hold":
      return { do: type, at_s: number("at_s"), hold_s: number("hold_s") };
    case "scale":
      return { do: type, percent: number("percent"), motors };
    case "isolate":
      return { do: type, motors };
    case "warm_up":
      return {
        do: type,
        less_deg: number("less_deg"),
        step_deg: number("step_deg"),
        pause_s: number("pause_s"),
      };
    case "stretch":
      return {
        do: type,
        further_deg: number("further_deg"),
        back_deg: number("back_deg"),
        hold_s: number("hold_s"),
      };
    case "mirror":
    case "guide":
      return { do: type };
    case "reteach":
      return {
        do: type,
        start_s: number("start_s"),
        end_s: number("end_s"),
        recording_id: newPart ?? "",
      };
    case "retouch":
      return { do: type, ...part };
  }
}
