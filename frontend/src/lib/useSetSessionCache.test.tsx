import { QueryClient, QueryClientProvider } from "@tanstack/react-query";
import { renderHook } from "@testing-library/react";
import { expect, test } from "vitest";
import type { Session } from "./api/client";
import { useSetSessionCache } from "./useSetSessionCache";

const session = (id: string, started_at: string, note: string) =>
  ({ id, started_at, note, patient: { id: "patient" } }) as Session;

const NEWEST = ["session", "newest", "patient"];

function setSessionIn(queries: QueryClient) {
  return renderHook(() => useSetSessionCache(), {
    wrapper: ({ children }) => <QueryClientProvider client={queries}>{children}</QueryClientProvider>,
  }).result.current;
}

test("an earlier request does not replace a saved session", async () => {
  const queries = new QueryClient();
  for (const queryKey of [["session", "a"], NEWEST]) {
    queries.setQueryData(queryKey, session("a", "2026-11-24T09:00:00Z", "first"));
    let resolve: (answer: Session) => void = () => {};
    const answered = new Promise<Session>((done) => {
      resolve = done;
    });
    const fetched = queries.fetchQuery({ queryKey, queryFn: () => answered }).catch(() => null);
    setSessionIn(queries)(session("a", "2026-11-24T09:00:00Z", "saved"));
    resolve(session("a", "2026-11-24T09:00:00Z", "stale"));
    await answered;
    await fetched;
    expect(queries.getQueryData<Session>(queryKey)?.note).toBe("saved");
  }
});

test("saving an older session keeps the newest one", async () => {
  const queries = new QueryClient();
  queries.setQueryData(NEWEST, session("b", "2026-11-24T10:00:00Z", "newest"));
  const fetched = queries.fetchQuery({
    queryKey: NEWEST,
    queryFn: async () => session("b", "2026-11-24T10:00:00Z", "fetched"),
  });
  setSessionIn(queries)(session("a", "2026-11-24T09:00:00Z", "saved"));
  await fetched;
  expect(queries.getQueryData<Session>(NEWEST)?.note).toBe("fetched");
});
