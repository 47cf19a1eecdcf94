import type { ProgrammeVersion, Recording, Schemas } from "../../lib/api/client";
import { AS_TAUGHT } from "../station/playSettingsModel";
import { firstResistanceLevel } from "../station/resistanceLevels";
import type { EndRangePrescription, ItemSettings } from "./describeProgramme";

/** An item during editing. Its key does not change when it moves. */
export type DraftItem = Omit<ItemSettings, "resistance_level"> & {
  key: string;
  recording_id: string;
  recording_name: string;
  /** Null until the user chooses a level, which is required for saving. */
  resistance_level: number | null;
  end_range: EndRangePrescription | null;
};
/** A programme during editing. */
export type Draft = { items: DraftItem[]; timer_minutes: number | null; sessions_per_week: number | null };

/** The request without the version on which it is based. */
export type Wanted = Omit<Schemas["VersionCreate"], "based_on">;

export const EMPTY: Draft = { items: [], timer_minutes: null, sessions_per_week: null };

/** Return a draft of an existing version. */
export function draftOf(version: ProgrammeVersion): Draft {
  return {
    items: version.items.map((item) => ({
      ...item,
      key: `version ${item.position}`,
      end_range: item.end_range ?? null,
    })),
    timer_minutes: version.timer_minutes,
    sessions_per_week: version.sessions_per_week,
  };
}

/**
 * Append a recording with the settings of the previous item, which fit the patient better than those of the
 * teaching. For the first item the user must choose the level. End-range time and self-pace belong to one recording.
 */
export function added(draft: Draft, recording: Recording, key: string, highest: number | null): Draft {
  const { speed_percent, repetitions, pause_s, range_percent, method, resistance_level } = draft.items.at(
    -1,
  ) ?? {
    ...AS_TAUGHT,
    resistance_level: firstResistanceLevel(null, highest),
  };
  const settings = {
    speed_percent,
    repetitions,
    pause_s,
    range_percent,
    method,
    resistance_level,
    self_paced: false,
  };
  const item = {
    ...settings,
    key,
    recording_id: recording.id,
    recording_name: recording.name,
    end_range: null,
  };
  return { ...draft, items: [...draft.items, item] };
}

/** Move an item by one place. */
export function moved(draft: Draft, place: number, by: 1 | -1): Draft {
  const items = [...draft.items];
  const [item] = items.splice(place, 1);
  if (item) items.splice(place + by, 0, item);
  return { ...draft, items };
}

/** Return the items of the request. Only the smooth method lets the patient set the pace. */
export function itemsOf(items: DraftItem[]): Wanted["items"] {
  return items.flatMap(({ resistance_level, ...item }) =>
    resistance_level === null
      ? []
      : [
          {
            recording_id: item.recording_id,
            speed_percent: item.speed_percent,
            repetitions: item.repetitions,
            pause_s: item.pause_s,
            range_percent: item.range_percent,
            method: item.method,
            resistance_level,
            end_range: item.end_range,
            self_paced: item.self_paced && item.method === "smooth",
          },
        ],
  );
}
