import { Button } from "@mantine/core";
import { t } from "../lib/i18n";

/** The part of TanStack's infinite query that this button uses. */
type PagedList = { hasNextPage: boolean; isFetchingNextPage: boolean; fetchNextPage: () => unknown };

/** Loads the next page of a list. Hidden at the end of the list. */
export function LoadMoreButton({
  list,
  words = t("common:lists.more"),
}: {
  list: PagedList;
  words?: string;
}) {
  if (!list.hasNextPage) return null;
  return (
    <Button variant="default" loading={list.isFetchingNextPage} onClick={() => void list.fetchNextPage()}>
      {words}
    </Button>
  );
}
