import { Box, Skeleton } from "@mantine/core";
import { type Query, useIsFetching, useQueryClient } from "@tanstack/react-query";
import { createContext, type ReactNode, useContext, useEffect, useState } from "react";
import { whenIdle } from "../lib/whenIdle";

const MAX_WAIT_MS = 5000;

/**
 * Queries that wait for their first answer. Queries with `late` have reserved space, so the page does not wait
 * for them.
 */
const firstFetch = {
  predicate: ({ state, meta }: Query) =>
    state.status === "pending" && state.fetchFailureCount === 0 && meta?.late !== true,
};

const Revealed = createContext(true);

/** Return whether the page around this component is shown. A query with `late` that waits for it delays no other. */
export const useRevealed = () => useContext(Revealed);

/**
 * Shows a page when all its first queries are answered, so that nothing moves under the user's finger. It waits
 * neither for failed queries nor longer than five seconds, and never hides the page again.
 */
export function RevealWhenLoaded(props: {
  children: ReactNode;
  /** True if the page must wait for an additional condition. */
  waits?: boolean;
  /** True to show the page immediately. */
  now?: boolean;
  /** Called once when the page is shown and the browser is idle. */
  onIdle?: () => void;
}) {
  const { children, waits = false, now = false, onIdle } = props;
  const queries = useQueryClient();
  const pending = useIsFetching(firstFetch);
  const [shown, setShown] = useState(false);
  useEffect(() => {
    if (pending > 0 || waits) return;
    // Counted again after the answer is rendered, because new parts may have started queries.
    const timer = setTimeout(() => {
      if (queries.isFetching(firstFetch) === 0) setShown(true);
    });
    return () => clearTimeout(timer);
  }, [pending, waits, queries]);
  useEffect(() => {
    const timer = setTimeout(() => setShown(true), MAX_WAIT_MS);
    return () => clearTimeout(timer);
  }, []);
  if (now && !shown) setShown(true);
  const visible = shown || now;
  // biome-ignore lint/correctness/useExhaustiveDependencies: called once, not for each new function
  useEffect(() => (visible && onIdle ? whenIdle(onIdle) : undefined), [visible]);
  return (
    <Box pos="relative" style={{ visibility: visible ? "visible" : "hidden" }}>
      <Revealed value={visible}>{children}</Revealed>
      {!visible && <Skeleton pos="absolute" top={0} h="60vh" style={{ visibility: "visible" }} aria-hidden />}
    </Box>
  );
}
