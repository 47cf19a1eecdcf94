import type { QueryClient, QueryKey } from "@tanstack/react-query";

/**
 * Replace the data of a query with the answer to a write.
 *
 * Cancels a running request of the query, because it was sent before the write and its older answer would replace the new one.
 */
export function replaceData<Data>(queries: QueryClient, queryKey: QueryKey, data: Data): void {
  void queries.cancelQueries({ queryKey, exact: true });
  queries.setQueryData<Data>(queryKey, data);
}
