import { useQuery } from "@tanstack/react-query";
import { api, type Session } from "./api/client";
import { POLL_OFFLINE_MS, useDatabaseUnavailable, withOfflineCopy } from "./offline";
import { usePagedQuery } from "./usePagedQuery";

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

/** Query all episodes of care of a patient, including closed ones. */
export function useEpisodes(patientId: string) {
  return useQuery({ queryKey: ["episodes", patientId], queryFn: () => api.episodes(patientId) });
}

/** Query the assessments of an episode, newest first, including withdrawn ones. Each page contains the baseline. */
export function useAssessments(episodeId: string) {
  return usePagedQuery(["assessments", episodeId], (after) => api.assessments(episodeId, after));
}

/** Return the highest resistance level allowed in an episode, or null without a limit. */
export function useMaxResistanceLevel(patientId: string, episodeId: string | null): number | null {
  const episodes = useEpisodes(patientId);
  return episodes.data?.items.find((episode) => episode.id === episodeId)?.max_load_level ?? null;
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
