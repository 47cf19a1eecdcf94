import { infiniteQueryOptions, keepPreviousData, useInfiniteQuery } from "@tanstack/react-query";
import { collectPages } from "./api/request";

type Page<Item> = { items: Item[]; next: string | null };

/** Return the options of a list that is queried page by page. */
export const pagedQuery = <Item, Fetched extends Page<Item>>(
  key: readonly unknown[],
  fetchPage: (after: string | null) => Promise<Fetched & Page<Item>>,
) =>
  infiniteQueryOptions({
    queryKey: key,
    queryFn: ({ pageParam }) => fetchPage(pageParam),
    initialPageParam: null as string | null,
    getNextPageParam: (page) => page.next,
  });

/** The most rows of a saved file. The service is asked for this many in a few seconds. */
const MOST_SAVED = 5_000;
const SAVED_PAGE = 200;

/** The rows for a file. `complete` is false if the list has more rows than a file may have. */
export type SavedRows<Item> = { rows: Item[]; complete: boolean };

/**
 * Query a list page by page. `items` contains the items of all loaded pages; a page may have further fields. `every`
 * fetches all rows for a file.
 */
export function usePagedQuery<Item, Fetched extends Page<Item> = Page<Item>>(
  key: readonly unknown[],
  fetchPage: (after: string | null, limit?: number) => Promise<Fetched & Page<Item>>,
) {
  const list = useInfiniteQuery({ ...pagedQuery(key, fetchPage), placeholderData: keepPreviousData });
  return {
    ...list,
    items: list.data?.pages.flatMap((page): Item[] => page.items),
    fetchAll: (): Promise<SavedRows<Item>> =>
      collectPages<Item>((after) => fetchPage(after, SAVED_PAGE), MOST_SAVED),
  };
}
