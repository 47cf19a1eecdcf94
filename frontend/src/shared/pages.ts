import { keepPreviousData, useInfiniteQuery } from "@tanstack/react-query";

type Page<Item> = { items: Item[]; next: string | null };

/** A list that is fetched a page at a time, with what has come of it so far in one piece. */
export function usePages<Item>(key: unknown[], fetchPage: (after: string | null) => Promise<Page<Item>>) {
  const list = useInfiniteQuery({
    queryKey: key,
    queryFn: ({ pageParam }) => fetchPage(pageParam),
    initialPageParam: null as string | null,
    getNextPageParam: (page) => page.next,
    placeholderData: keepPreviousData,
  });
  return { ...list, items: list.data?.pages.flatMap((page) => page.items) };
}
