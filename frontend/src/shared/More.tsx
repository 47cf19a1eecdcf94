import { Button } from "@mantine/core";
import { LISTS } from "./words";

/** What a list that grows can be asked for: TanStack's infinite query is one. */
type Growing = { hasNextPage: boolean; isFetchingNextPage: boolean; fetchNextPage: () => unknown };

/** More of a list, where there is more. */
export function More({ list }: { list: Growing }) {
  if (!list.hasNextPage) return null;
  return (
    <Button variant="default" loading={list.isFetchingNextPage} onClick={() => void list.fetchNextPage()}>
      {LISTS.more}
    </Button>
  );
}
