import { MantineProvider } from "@mantine/core";
import { QueryClient, QueryClientProvider } from "@tanstack/react-query";
import { cleanup, fireEvent, render, renderHook, screen } from "@testing-library/react";
import { afterEach, expect, it, vi } from "vitest";
import { LoadMoreButton } from "../ui/LoadMoreButton";
import { usePagedQuery } from "./usePagedQuery";

afterEach(cleanup);

function List({ fetchPage }: { fetchPage: (after: string | null) => Promise<Page> }) {
  const list = usePagedQuery(["list"], fetchPage);
  return (
    <>
      <p>{list.items?.join(" ")}</p>
      <LoadMoreButton list={list} />
    </>
  );
}
type Page = { items: string[]; next: string | null };

it("a list grows page by page to its end", async () => {
  const pages: Record<string, Page> = {
    "": { items: ["a", "b"], next: "behind b" },
    "behind b": { items: ["c"], next: null },
  };
  const fetchPage = vi.fn(async (after: string | null) => pages[after ?? ""] as Page);
  render(
    <MantineProvider env="test">
      <QueryClientProvider client={new QueryClient()}>
        <List fetchPage={fetchPage} />
      </QueryClientProvider>
    </MantineProvider>,
  );
  await screen.findByText("a b");
  fireEvent.click(screen.getByRole("button", { name: "Show more" }));
  await screen.findByText("a b c");
  expect(screen.queryByRole("button")).toBeNull();
  expect(fetchPage.mock.calls).toEqual([[null], ["behind b"]]);
});

it.each([
  [2, 3, true],
  [200, 5000, false],
])("fetches every row of pages of %s for a file, up to a limit", async (size, rows, complete) => {
  // A list of three rows, or one without an end.
  const fetchPage = async (after: string | null, limit?: number) => {
    expect(limit).toBe(200);
    return size === 2 && after
      ? { items: ["c"], next: null }
      : { items: Array<string>(size).fill("a"), next: "behind" };
  };
  const { result } = renderHook(() => usePagedQuery(["all"], fetchPage), {
    wrapper: ({ children }) => (
      <QueryClientProvider client={new QueryClient({ defaultOptions: { queries: { enabled: false } } })}>
        {children}
      </QueryClientProvider>
    ),
  });
  const found = await result.current.fetchAll();
  expect([found.rows.length, found.complete]).toEqual([rows, complete]);
});
