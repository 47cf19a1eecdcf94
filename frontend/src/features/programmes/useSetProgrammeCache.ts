import { useQueryClient } from "@tanstack/react-query";
import type { Programme } from "../../lib/api/client";
import { replaceData } from "../../lib/replaceData";

/** Return a function that stores the service's answer as the programme's cached data. */
export function useSetProgrammeCache() {
  const queries = useQueryClient();
  return (saved: Programme) => {
    replaceData(queries, ["programme", saved.id], saved);
    void queries.invalidateQueries({ queryKey: ["programmes"] });
    void queries.invalidateQueries({ queryKey: ["adherence", saved.episode_id] });
  };
}
