import { keepPreviousData, useInfiniteQuery } from "@tanstack/react-query";

type Page<Item> = { items: Item[]; next: string | null };

/** Query a list page by page. `items` contains the items of all loaded pages; a page may have further fields. */
export function usePagedQuery<Item, Fetched extends Page<Item> = Page<Item>>(
  key: unknown[],
  fetchPage: (after: string | null) => Promise<Fetched & Page<Item>>,
) {
  const list = useInfiniteQuery({
    queryKey: key,
    queryFn: ({ pageParam }) => fetchPage(pageParam),
    initialPageParam: null as string | null,
    getNextPageParam: (page) => page.next,
    placeholderData: keepPreviousData,
  });
  return { ...list, items: list.data?.pages.flatMap((page): Item[] => page.items) };
}
