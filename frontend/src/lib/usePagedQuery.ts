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

/** Query a list page by page. `items` contains the items of all loaded pages; a page may have further fields. */
export function usePagedQuery<Item, Fetched extends Page<Item> = Page<Item>>(
  key: readonly unknown[],
  fetchPage: (after: string | null) => Promise<Fetched & Page<Item>>,
) {
  const list = useInfiniteQuery({ ...pagedQuery(key, fetchPage), placeholderData: keepPreviousData });
  return { ...list, items: list.data?.pages.flatMap((page): Item[] => page.items) };
}
