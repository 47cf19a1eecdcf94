import { useQuery, useQueryClient } from "@tanstack/react-query";
import { useEffect, useRef } from "react";
import { api, ProblemError, type ReadyPatient } from "./api/client";
import { useLive } from "./live/hooks";

/** While the database is away nothing tells when a run has been measured: it is asked. */
export const ASK_AGAIN_MS = 2000;

/** Whether the database does not answer, as the live state tells. */
export const useAway = (): boolean => Boolean(useLive("database")?.unavailable_since);

/** Whether it is that what was asked for stands in a database that does not answer. */
export const isAway = (error: unknown): boolean =>
  error instanceof ProblemError && error.code === "database_away";

/** While the database is away: whom a session can begin or goes on for at this station. */
export function useReady() {
  const away = useAway();
  return useQuery({
    queryKey: ["ready"],
    queryFn: api.ready,
    enabled: away,
    refetchInterval: away ? ASK_AGAIN_MS : false,
  });
}

/** What the record says of a patient; while the database is away, what the station has kept of it, if it has. */
export async function orReady<T>(
  patientId: string,
  ask: () => Promise<T>,
  kept: (ready: ReadyPatient) => T,
): Promise<T> {
  try {
    return await ask();
  } catch (error) {
    const ready = isAway(error) ? await api.ready() : [];
    const one = ready.find(({ patient }) => patient.id === patientId);
    if (!one) throw error;
    return kept(one);
  }
}

/** Ask for everything anew once the database answers again: what was shown meanwhile was not all there is. */
export function useBackAgain(): void {
  const queries = useQueryClient();
  const away = useAway();
  const was = useRef(away);
  useEffect(() => {
    if (was.current && !away) void queries.invalidateQueries();
    was.current = away;
  }, [queries, away]);
}
