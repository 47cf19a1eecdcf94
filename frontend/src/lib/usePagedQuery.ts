import { infiniteQueryOptions, keepPreviousData, useInfiniteQuery } from "@tanstack/react-query";

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

/** Fetch the rows of every page, at most as many as a file may have. */
async function fetchEvery<Item>(
  fetchPage: (after: string | null, limit: number) => Promise<Page<Item>>,
): Promise<SavedRows<Item>> {
  const rows: Item[] = [];
  let after: string | null = null;
  do {
    const page: Page<Item> = await fetchPage(after, SAVED_PAGE);
    rows.push(...page.items);
    after = page.next;
  } while (after && rows.length < MOST_SAVED);
  return { rows: rows.slice(0, MOST_SAVED), complete: !after && rows.length <= MOST_SAVED };
}

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
    every: () => fetchEvery<Item>(fetchPage),
  };
}
