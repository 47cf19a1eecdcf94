import { useQuery, useQueryClient } from "@tanstack/react-query";
import { useEffect, useRef } from "react";
import { api, ProblemError, type ReadyPatient } from "./api/client";
import { useLive } from "./live/hooks";

/** Poll interval without the database. Then no message reports that a run was saved. */
export const POLL_OFFLINE_MS = 2000;

/** True if the live state reports that the database is unavailable. */
export const useDatabaseUnavailable = (): boolean => Boolean(useLive("database")?.unavailable_since);

/** True if the request failed because the database is unavailable. */
export const isDatabaseUnavailable = (error: unknown): boolean =>
  error instanceof ProblemError && error.code === "database_away";

/** Query the patients whose sessions this station can start or continue without the database. */
export function useReadyPatients() {
  const unavailable = useDatabaseUnavailable();
  return useQuery({
    queryKey: ["ready"],
    queryFn: api.readyPatients,
    enabled: unavailable,
    refetchInterval: unavailable ? POLL_OFFLINE_MS : false,
  });
}

/** Return the answer of `ask`, or the station's offline copy if the database is unavailable. */
export async function withOfflineCopy<T>(
  patientId: string,
  ask: () => Promise<T>,
  select: (copy: ReadyPatient) => T,
): Promise<T> {
  try {
    return await ask();
  } catch (error) {
    const patients = isDatabaseUnavailable(error) ? await api.readyPatients() : [];
    const patientCopy = patients.find(({ patient }) => patient.id === patientId);
    if (!patientCopy) throw error;
    return select(patientCopy);
  }
}

/** Fetch everything again when the database returns, because the offline data was incomplete. */
export function useRefetchAfterOutage(): void {
  const queries = useQueryClient();
  const unavailable = useDatabaseUnavailable();
  const wasUnavailable = useRef(unavailable);
  useEffect(() => {
    if (wasUnavailable.current && !unavailable) void queries.invalidateQueries();
    wasUnavailable.current = unavailable;
  }, [queries, unavailable]);
}
