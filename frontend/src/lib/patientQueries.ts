import { queryOptions, useQuery, useQueryClient } from "@tanstack/react-query";
import { useEffect } from "react";
import { api, type Session } from "./api/client";
import { POLL_OFFLINE_MS, useDatabaseUnavailable, withOfflineCopy } from "./offline";
import { pagedQuery, usePagedQuery } from "./usePagedQuery";

/** Maximum number of sessions of a timeline. A patient with two sessions a week for two years has more than this. */
const MOST_SESSIONS = 200;

/** Query all recordings of a patient, including archived ones. */
export function useRecordings(patientId: string | null) {
  return useQuery({
    queryKey: ["recordings", patientId],
    // Without the database, the session's programme says which recordings may be played.
    queryFn: () =>
      withOfflineCopy(
        patientId ?? "",
        () => api.recordings(patientId ?? ""),
        () => ({ items: [] }),
      ),
    enabled: patientId !== null,
  });
}

/** The query of a patient's record. */
export const patientOf = (patientId: string) =>
  queryOptions({ queryKey: ["patient", patientId], queryFn: () => api.patient(patientId) });

/** Query all episodes of care of a patient, including closed ones. */
export function useEpisodes(patientId: string) {
  return useQuery({ queryKey: ["episodes", patientId], queryFn: () => api.episodes(patientId) });
}

/** The query of what an assessment can contain. It never changes while the page is open. */
export const ASSESSMENT_FORM = queryOptions({
  queryKey: ["assessment-form"],
  queryFn: () => api.assessmentForm(),
  staleTime: Number.POSITIVE_INFINITY,
});

/** The pages of an episode's assessments, newest first, including withdrawn ones. Each page contains the baseline. */
const assessmentsOf = (episodeId: string) =>
  [["assessments", episodeId], (after: string | null) => api.assessments(episodeId, after)] as const;

/** Query the assessments of an episode. */
export const useAssessments = (episodeId: string) => usePagedQuery(...assessmentsOf(episodeId));

/** The query of a patient's programmes. */
export const programmesOf = (patientId: string) =>
  queryOptions({ queryKey: ["programmes", "of", patientId], queryFn: () => api.programmes(patientId) });

/** The query of how regularly a patient follows the programme of an episode. */
export const adherenceOf = (episodeId: string) =>
  queryOptions({ queryKey: ["adherence", episodeId], queryFn: () => api.adherence(episodeId) });

/** The query of the newest sessions of a patient for the timeline. */
export const timelineOf = (patientId: string) =>
  queryOptions({
    queryKey: ["sessions", "timeline", patientId],
    queryFn: () => api.patientSessions(patientId, null, MOST_SESSIONS),
  });

/**
 * Start all requests of a patient's summary at once. Each part would start its own only after the answers of the
 * parts before it.
 */
export function useSummaryPrefetch(patientId: string, episodeId: string | null): void {
  const queries = useQueryClient();
  useEffect(() => {
    if (episodeId === null) return;
    void queries.prefetchQuery(ASSESSMENT_FORM);
    void queries.prefetchInfiniteQuery(pagedQuery(...assessmentsOf(episodeId)));
    void queries.prefetchQuery(timelineOf(patientId));
    void queries.prefetchQuery(programmesOf(patientId));
    void queries.prefetchQuery(adherenceOf(episodeId));
  }, [queries, patientId, episodeId]);
}

/** Return the highest resistance level allowed in an episode, or null without a limit. */
export function useMaxResistanceLevel(patientId: string, episodeId: string | null): number | null {
  const episodes = useEpisodes(patientId);
  return episodes.data?.items.find((episode) => episode.id === episodeId)?.max_resistance_level ?? null;
}

/** Return true if the doctor permits in an episode that the patient sets the pace of a playback. */
export function useSelfPacedPermitted(patientId: string, episodeId: string | null): boolean {
  const episodes = useEpisodes(patientId);
  return episodes.data?.items.find((episode) => episode.id === episodeId)?.self_paced_permitted ?? false;
}

/** Query the patient's newest session, or a selection of it; null without a session. */
export function useNewestSession<Selected = Session | null>(
  patientId: string | null,
  select?: (newest: Session | null) => Selected,
) {
  const unavailable = useDatabaseUnavailable();
  return useQuery({
    queryKey: ["session", "newest", patientId],
    queryFn: () =>
      withOfflineCopy(
        patientId ?? "",
        async (): Promise<Session | null> => {
          const newest = (await api.patientSessions(patientId ?? "")).items[0];
          return newest ? await api.session(newest.id) : null;
        },
        (copy) => copy.session,
      ),
    enabled: patientId !== null,
    refetchInterval: unavailable ? POLL_OFFLINE_MS : false,
    ...(select && { select }),
  });
}
