import { useQuery } from "@tanstack/react-query";
import { api, type Session } from "./api/client";
import { ASK_AGAIN_MS, orReady, useAway } from "./offline";

/** Everything that a patient was taught, put away or not. */
export function useRecordings(patientId: string | null) {
  return useQuery({
    queryKey: ["recordings", patientId],
    // What may be played without the database stands in the programme.
    queryFn: () =>
      orReady(
        patientId ?? "",
        () => api.recordings(patientId ?? ""),
        () => ({ items: [] }),
      ),
    enabled: patientId !== null,
  });
}

/** The episodes of a patient's care, closed ones too. */
export function useEpisodes(patientId: string) {
  return useQuery({ queryKey: ["episodes", patientId], queryFn: () => api.episodes(patientId) });
}

/** The highest resistance level that the doctor allows in an episode of care; null where none is known. */
export function useHighestLevel(patientId: string, episodeId: string | null): number | null {
  const episodes = useEpisodes(patientId);
  return episodes.data?.items.find((one) => one.id === episodeId)?.max_load_level ?? null;
}

/** A patient's newest session, or what is wanted of it; null where there was none. */
export function useNewestSession<Wanted = Session | null>(
  patientId: string | null,
  select?: (newest: Session | null) => Wanted,
) {
  const away = useAway();
  return useQuery({
    queryKey: ["session", "newest", patientId],
    queryFn: () =>
      orReady(
        patientId ?? "",
        async (): Promise<Session | null> => {
          const newest = (await api.patientSessions(patientId ?? "")).items[0];
          return newest ? await api.session(newest.id) : null;
        },
        (ready) => ready.session,
      ),
    enabled: patientId !== null,
    refetchInterval: away ? ASK_AGAIN_MS : false,
    ...(select && { select }),
  });
}
