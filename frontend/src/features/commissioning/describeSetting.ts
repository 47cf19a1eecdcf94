import "./catalogue";
import i18next from "i18next";
import type { Schemas } from "../../lib/api/client";
import { t } from "../../lib/i18n";
import { LANGUAGE } from "../../lib/language";

type Names = Partial<{ [name: string]: string }>;
type ValueNames = Partial<{ [field: string]: Names }>;

// Read the texts as an object, because i18next would take a colon in a key as the end of a namespace.
const {
  fields: FIELDS,
  units: UNITS,
  values: VALUES,
  settingValues: SETTING_VALUES,
}: Record<"fields" | "units" | "values", Names> & { settingValues: ValueNames } = i18next.getResourceBundle(
  LANGUAGE,
  "commissioning",
);
/** Digits as the station's file contains them, so that a value and its range can be compared. */
const NUMBER = new Intl.NumberFormat(LANGUAGE, { maximumSignificantDigits: 10, useGrouping: false });

/** Return what a field of the station's file means. `name`: name in the file, for example `axes[1].lag_s`. */
export const describeField = (name: string): string =>
  FIELDS[name.replace(/\[\d\]/, "")] ?? FIELDS[name.split(".")[0] ?? ""] ?? "";

/** Return a unit of the station's file in the user's language. */
export const describeUnit = (unit: string): string => UNITS[unit] ?? unit;

/**
 * Return what a field's value means in the user's language; empty for a number, a name, and the word of the file
 * itself.
 */
export const describeValue = (field: string, value: string): string => {
  const words = SETTING_VALUES[field]?.[value] ?? "";
  return words === value ? "" : words;
};

/** Return the unit of a field. For a number without a unit, say that it has none. */
export const describeFieldUnit = ({ unit, accepted }: Schemas["SettingField"]): string =>
  unit || !accepted ? describeUnit(unit) : t("commissioning:ranges.noUnit");

/** Return the values that a field accepts, without its unit; empty for a text. */
export function describeAcceptedValues(accepted: Schemas["AcceptedValues"] | null): string {
  if (!accepted) return "";
  const { low, high, choices, step, none } = accepted;
  let values: string = t("commissioning:ranges.span", { low: NUMBER.format(low), high: NUMBER.format(high) });
  if (choices.length > 0)
    values = t("commissioning:ranges.choices", {
      choices: choices.map((one) => NUMBER.format(one)).join(", "),
    });
  if (step !== null) values = t("commissioning:ranges.steps", { values, step });
  return withMinus(none === null ? values : t("commissioning:ranges.orNone", { values, none }));
}

/** Return a text with a minus sign instead of the hyphen before each negative number. */
export const withMinus = (text: string): string => text.replace(/(^|[\s,])-(?=\d)/g, "$1−");

/** The templates of the names that records contain. `{load}` is replaced by a part that varies. */
const TEMPLATES = Object.entries(VALUES).map(([template, words = ""]) => ({
  pattern: new RegExp(`^${escaped(template).replace(/\\\{\w+\\\}/g, "(.+)")}$`),
  places: [...template.matchAll(/\{(\w+)\}/g)].map(([place]) => place),
  words,
}));

/**
 * Return the name of a recorded value, or a recorded text, in the user's language. Names of later versions stay
 * unchanged.
 */
export function describeRecordedValue(name: string): string {
  for (const { pattern, places, words } of TEMPLATES) {
    const parts = pattern.exec(name)?.slice(1);
    if (parts)
      return places.reduce((text, place, n) => text.replace(place, describePart(parts[n] ?? "")), words);
  }
  return name;
}

const describePart = (part: string): string => VALUES[part] ?? part;

function escaped(text: string): string {
  return text.replace(/[.*+?^${}()|[\]\\]/g, "\\$&");
}
