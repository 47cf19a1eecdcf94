import { useQueryClient } from "@tanstack/react-query";
import type { Session } from "../api/client";

/** Let every screen know a session as the service has just answered it. */
export function useKeepSession(): (saved: Session) => void {
  const queries = useQueryClient();
  return (saved) => {
    queries.setQueryData(["session", saved.id], saved);
    queries.setQueryData<Session | null>(["session", "newest", saved.patient.id], (known) =>
      // An older one that is looked at does not become the newest.
      known && known.started_at > saved.started_at ? known : saved,
    );
    void queries.invalidateQueries({ queryKey: ["session", saved.id, "draft"] });
    void queries.invalidateQueries({ queryKey: ["sessions"] });
  };
}
