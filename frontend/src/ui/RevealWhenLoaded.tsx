import { Box, Skeleton } from "@mantine/core";
import { type Query, useIsFetching, useQueryClient } from "@tanstack/react-query";
import { type ReactNode, useEffect, useState } from "react";

const LIMIT_MS = 5000;

/** What is asked for the first time, and not answered yet. What is `late` has its room kept free, and nobody waits for it. */
const first = {
  predicate: ({ state, meta }: Query) =>
    state.status === "pending" && state.fetchFailureCount === 0 && meta?.late !== true,
};

/**
 * A page whose parts are asked for one by one, shown once all of them are there: nothing moves away under a finger that is on its way.
 * What fails is not waited for, nor is anything for longer than five seconds; once shown, it stays.
 */
export function RevealWhenLoaded(props: {
  children: ReactNode;
  /** Whatever else it waits for has not come. */
  waits?: boolean;
  /** Somebody needs it now, whole or not. */
  now?: boolean;
}) {
  const { children, waits = false, now = false } = props;
  const queries = useQueryClient();
  const asked = useIsFetching(first);
  const [shown, setShown] = useState(false);
  useEffect(() => {
    if (asked > 0 || waits) return;
    // Counted again once what has just been answered is drawn: its parts may have begun to ask by then.
    const drawn = setTimeout(() => {
      if (queries.isFetching(first) === 0) setShown(true);
    });
    return () => clearTimeout(drawn);
  }, [asked, waits, queries]);
  useEffect(() => {
    const limit = setTimeout(() => setShown(true), LIMIT_MS);
    return () => clearTimeout(limit);
  }, []);
  if (now && !shown) setShown(true);
  const visible = shown || now;
  return (
    <Box pos="relative" style={{ visibility: visible ? "visible" : "hidden" }}>
      {children}
      {!visible && <Skeleton pos="absolute" top={0} h="60vh" style={{ visibility: "visible" }} aria-hidden />}
    </Box>
  );
}
