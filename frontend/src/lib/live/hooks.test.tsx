import { QueryClient, QueryClientProvider } from "@tanstack/react-query";
import { renderHook } from "@testing-library/react";
import { expect, test, vi } from "vitest";
import { useSavedRecords } from "./hooks";
import { store } from "./store";

test("a session is stale when the connection returns", () => {
  const onReconnected = vi.spyOn(store, "onReconnected");
  const queries = new QueryClient();
  queries.setQueryData(["session", "s"], { runs: [] });
  const hook = renderHook(useSavedRecords, {
    wrapper: ({ children }) => <QueryClientProvider client={queries}>{children}</QueryClientProvider>,
  });
  expect(queries.getQueryState(["session", "s"])?.isInvalidated).toBe(false);
  onReconnected.mock.calls[0]?.[0]();
  expect(queries.getQueryState(["session", "s"])?.isInvalidated).toBe(true);
  hook.unmount();
});
