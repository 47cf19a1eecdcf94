import { useQueryClient } from "@tanstack/react-query";
import type { Session } from "./api/client";
import { replaceData } from "./replaceData";

/** Return a function that stores the service's answer as the session's cached data. */
export function useSetSessionCache(): (saved: Session) => void {
  const queries = useQueryClient();
  return (saved) => {
    replaceData(queries, ["session", saved.id], saved);
    const newestKey = ["session", "newest", saved.patient.id];
    const newest = queries.getQueryData<Session | null>(newestKey);
    // An older session does not replace the newest one.
    if (!newest || newest.started_at <= saved.started_at) replaceData(queries, newestKey, saved);
    void queries.invalidateQueries({ queryKey: ["session", saved.id, "draft"] });
    void queries.invalidateQueries({ queryKey: ["sessions"] });
  };
}
