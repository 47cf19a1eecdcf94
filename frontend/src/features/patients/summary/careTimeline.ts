import type { Episode, Schemas } from "../../../lib/api/client";

type Stage = Episode["stages"][number];
/** A stage from its first day to the first day of the next stage, or to `until`. */
type StageSpan = { stage: Stage["stage"]; from: string; to: string };

/** Return the spans of an episode's stages, oldest first, up to `until`. */
export function stageSpans(stages: Stage[], until: string): StageSpan[] {
  const sorted = [...stages].sort((a, b) => a.since.localeCompare(b.since));
  return sorted.map(({ stage, since }, n) => ({ stage, from: since, to: sorted[n + 1]?.since ?? until }));
}

/** Return the times that the timeline must cover: from the opening, or the first stage or session, to `until`. */
export function timelineEnds(
  episode: Episode,
  sessions: Schemas["SessionSummary"][],
  until: string,
): [first: string, last: string] {
  const moments = [episode.opened_at, ...episode.stages.map(({ since }) => since)];
  const first = [...moments, ...sessions.map(({ started_at }) => started_at)].reduce((earliest, moment) =>
    Date.parse(moment) < Date.parse(earliest) ? moment : earliest,
  );
  return [first, episode.closed_at ?? until];
}
