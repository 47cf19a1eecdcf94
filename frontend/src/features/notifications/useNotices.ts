import { useQuery } from "@tanstack/react-query";
import { api } from "../../lib/api/client";
import { useDatabaseUnavailable } from "../../lib/offline";
import { useHasPermission } from "../auth/hooks";
import { type Notice, toNotice } from "./notices";

/**
 * Interval between requests. It can be long, because the state bar shows alarms at the user's own station at
 * once.
 */
const REFETCH_MS = 300_000;

export const NOTICES_KEY = ["notices"];

export interface Notices {
  /** Newest first. */
  notices: Notice[];
  unread: number;
  /** True if the service has not answered. */
  failed: boolean;
}

/** Return the notices that the user may see. */
export function useNotices(): Notices {
  const available = !useDatabaseUnavailable();
  const sees = useHasPermission("see_station");
  const found = useQuery({
    queryKey: NOTICES_KEY,
    queryFn: api.notifications,
    enabled: sees && available,
    refetchInterval: REFETCH_MS,
    staleTime: REFETCH_MS,
  });
  const notices = (found.data?.items ?? []).map(toNotice);
  return { notices, unread: notices.filter(({ read }) => !read).length, failed: found.isError };
}
