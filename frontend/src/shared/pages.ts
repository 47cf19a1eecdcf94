import { keepPreviousData, useInfiniteQuery } from "@tanstack/react-query";

type Page = { items: unknown[]; next: string | null };

/** A list that is fetched a page at a time, with what has come of it so far in one piece. */
export function usePages<Found extends Page>(
  key: unknown[],
  fetchPage: (after: string | null) => Promise<Found>,
) {
  const list = useInfiniteQuery({
    queryKey: key,
    queryFn: ({ pageParam }) => fetchPage(pageParam),
    initialPageParam: null as string | null,
    getNextPageParam: (page) => page.next,
    placeholderData: keepPreviousData,
  });
  const items = list.data?.pages.flatMap((page): Found["items"][number][] => page.items);
  return { ...list, items };
}
