import { Button } from "@mantine/core";
import { LISTS } from "../lib/messages";

/** What a list that grows can be asked for: TanStack's infinite query is one. */
type Growing = { hasNextPage: boolean; isFetchingNextPage: boolean; fetchNextPage: () => unknown };

/** More of a list, where there is more; `words` where it is not what is in sight that grows. */
export function LoadMoreButton({ list, words = LISTS.more }: { list: Growing; words?: string }) {
  if (!list.hasNextPage) return null;
  return (
    <Button variant="default" loading={list.isFetchingNextPage} onClick={() => void list.fetchNextPage()}>
      {words}
    </Button>
  );
}
