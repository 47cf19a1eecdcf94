import type { ProgrammeVersion, Recording, Schemas } from "../../lib/api/client";
import { firstLevel } from "../station/loadLevels";
import { AS_TAUGHT } from "../station/playSettingsModel";
import type { ItemSettings } from "./describeProgramme";

/** One recording of a programme that is being written; the key stays its own wherever it is moved. */
export type DraftItem = Omit<ItemSettings, "load_level"> & {
  key: string;
  recording_id: string;
  recording_name: string;
  /** Null until it is chosen; no programme is saved before. */
  load_level: number | null;
};
/** What a programme is to say. */
export type Draft = { items: DraftItem[]; timer_minutes: number | null; sessions_per_week: number | null };

/** What the service is told of it. */
export type Wanted = Omit<Schemas["VersionCreate"], "based_on">;

export const EMPTY: Draft = { items: [], timer_minutes: null, sessions_per_week: null };

/** What a version says, to be changed. */
export function draftOf(version: ProgrammeVersion): Draft {
  return {
    items: version.items.map((item) => ({ ...item, key: `version ${item.position}` })),
    timer_minutes: version.timer_minutes,
    sessions_per_week: version.sessions_per_week,
  };
}

/**
 * Last, with the settings of the one before it: what fits one motion is nearer than what was taught. The level of the first one has to be
 * chosen.
 */
export function added(draft: Draft, recording: Recording, key: string, highest: number | null): Draft {
  const { speed_percent, repetitions, pause_s, range_percent, method, load_level } = draft.items.at(-1) ?? {
    ...AS_TAUGHT,
    load_level: firstLevel(null, highest),
  };
  const settings = { speed_percent, repetitions, pause_s, range_percent, method, load_level };
  const item = { ...settings, key, recording_id: recording.id, recording_name: recording.name };
  return { ...draft, items: [...draft.items, item] };
}

/** One place up or down. */
export function moved(draft: Draft, place: number, by: 1 | -1): Draft {
  const items = [...draft.items];
  const [item] = items.splice(place, 1);
  if (item) items.splice(place + by, 0, item);
  return { ...draft, items };
}

/** As the service takes it. */
export function itemsOf(items: DraftItem[]): Wanted["items"] {
  return items.flatMap(
    ({ recording_id, speed_percent, repetitions, pause_s, range_percent, method, load_level }) =>
      load_level === null
        ? []
        : [{ recording_id, speed_percent, repetitions, pause_s, range_percent, method, load_level }],
  );
}
