import { useQuery } from "@tanstack/react-query";
import { api, type Session } from "../api/client";

/** Everything that a patient was taught, put away or not. */
export function useRecordings(patientId: string | null) {
  return useQuery({
    queryKey: ["recordings", patientId],
    queryFn: () => api.recordings(patientId ?? ""),
    enabled: patientId !== null,
  });
}

/** A patient's newest session, or what is wanted of it; null where there was none. */
export function useNewestSession<Wanted = Session | null>(
  patientId: string | null,
  select?: (newest: Session | null) => Wanted,
) {
  return useQuery({
    queryKey: ["session", "newest", patientId],
    queryFn: async (): Promise<Session | null> => {
      const newest = (await api.patientSessions(patientId ?? "")).items[0];
      return newest ? await api.session(newest.id) : null;
    },
    enabled: patientId !== null,
    ...(select && { select }),
  });
}
