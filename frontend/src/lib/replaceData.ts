import type { QueryClient, QueryKey } from "@tanstack/react-query";

/**
 * Replace what a query has fetched with the answer to a write.
 *
 * A request that was sent before the write may be answered after it. It is cancelled, or its older answer would replace the new one.
 */
export function replaceData<Data>(queries: QueryClient, queryKey: QueryKey, data: Data): void {
  void queries.cancelQueries({ queryKey, exact: true });
  queries.setQueryData<Data>(queryKey, data);
}
