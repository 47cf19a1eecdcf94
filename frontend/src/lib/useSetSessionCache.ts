import { useQueryClient } from "@tanstack/react-query";
import type { Session } from "./api/client";
import { replaceData } from "./replaceData";

/** Return a function that replaces a session on every screen with what the service has just answered. */
export function useSetSessionCache(): (saved: Session) => void {
  const queries = useQueryClient();
  return (saved) => {
    replaceData(queries, ["session", saved.id], saved);
    const newestKey = ["session", "newest", saved.patient.id];
    const newest = queries.getQueryData<Session | null>(newestKey);
    // An older session that is open on the screen does not become the newest.
    if (!newest || newest.started_at <= saved.started_at) replaceData(queries, newestKey, saved);
    void queries.invalidateQueries({ queryKey: ["session", saved.id, "draft"] });
    void queries.invalidateQueries({ queryKey: ["sessions"] });
  };
}
