import { useQueryClient } from "@tanstack/react-query";
import type { Programme } from "../api/client";
import { replaceData } from "../shared/replaceData";

/** Let every screen know a programme as the service has just answered it. */
export function useKeep() {
  const queries = useQueryClient();
  return (saved: Programme) => {
    replaceData(queries, ["programme", saved.id], saved);
    void queries.invalidateQueries({ queryKey: ["programmes"] });
    void queries.invalidateQueries({ queryKey: ["adherence", saved.episode_id] });
  };
}
