import { useQuery, useQueryClient } from "@tanstack/react-query";
import { api } from "../../lib/api/client";
import { useDatabaseUnavailable } from "../../lib/offline";
import { useHasPermission } from "../auth/hooks";
import { type Notice, toNotice } from "./notices";

/**
 * Interval between requests. It can be long, because the state bar shows alarms at the user's own station at
 * once.
 */
const REFETCH_MS = 300_000;

export interface Notices {
  /** Newest first. */
  notices: Notice[];
  unread: Notice[];
  /** True if the service has not answered. */
  failed: boolean;
  markRead: () => void;
}

const READ = ["notices-read"];

/**
 * Return the notices that the user may see. Read notices are remembered until the page is reloaded or the user
 * signs out.
 */
export function useNotices(): Notices {
  const available = !useDatabaseUnavailable();
  const sees = useHasPermission("see_station");
  const queries = useQueryClient();
  const read = useQuery({ queryKey: READ, queryFn: () => "", staleTime: Number.POSITIVE_INFINITY });
  const readUntil = read.data ?? "";
  const found = useQuery({
    queryKey: ["notices"],
    queryFn: api.notifications,
    enabled: sees && available,
    refetchInterval: REFETCH_MS,
    staleTime: REFETCH_MS,
  });
  const notices = (found.data?.items ?? []).map(toNotice);
  return {
    notices,
    unread: notices.filter(({ at }) => at > readUntil),
    failed: found.isError,
    markRead: () => queries.setQueryData(READ, notices[0]?.at ?? readUntil),
  };
}
