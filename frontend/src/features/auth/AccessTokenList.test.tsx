import { MantineProvider } from "@mantine/core";
import { QueryClient, QueryClientProvider } from "@tanstack/react-query";
import { cleanup, fireEvent, render, screen, waitFor } from "@testing-library/react";
import { afterEach, expect, it, vi } from "vitest";
import type { Schemas } from "../../lib/api/client";
import { AccessTokenList } from "./AccessTokenList";

const TOKENS: Schemas["AccountAccessToken"][] = [
  {
    id: "00000000-0000-4000-8000-000000000011",
    account_id: "00000000-0000-4000-8000-000000000001",
    owner: "Ito Mai",
    name: "Nightly export",
    created_at: "2026-11-01T00:00:00Z",
    expires_at: "2026-12-01T00:00:00Z",
    last_used_at: null,
  },
  {
    id: "00000000-0000-4000-8000-000000000012",
    account_id: "00000000-0000-4000-8000-000000000002",
    owner: "Abe Rin",
    name: "Weekly figures",
    created_at: "2026-10-01T00:00:00Z",
    expires_at: "2027-10-01T00:00:00Z",
    last_used_at: "2026-11-20T00:00:00Z",
  },
];

const show = (tokens: React.ComponentProps<typeof AccessTokenList>["tokens"], revoke = vi.fn()) => {
  render(
    <MantineProvider env="test">
      <QueryClientProvider client={new QueryClient()}>
        <AccessTokenList tokens={tokens} queryKey="access-tokens" revoke={revoke} />
      </QueryClientProvider>
    </MantineProvider>,
  );
  return revoke;
};
const heads = () =>
  screen
    .getAllByRole("columnheader")
    .map(({ textContent }) => textContent)
    .join(", ");
const names = () =>
  screen
    .getAllByRole("row")
    .slice(1)
    .map((row) => row.firstChild?.textContent);

afterEach(cleanup);

it("is a table with the owner, sorted by the last use", () => {
  show(TOKENS);
  expect(heads()).toBe("Token, Account, Created, Valid until, Last used, Actions");
  expect(screen.getByRole("row", { name: /Nightly export.*Not yet/ })).toBeTruthy();
  fireEvent.click(screen.getByRole("button", { name: "Last used" }));
  expect(names()).toEqual(["Weekly figures", "Nightly export"]);
});

it("does not name the owner of the user's own tokens", () => {
  show(TOKENS.map(({ owner, account_id, ...token }) => token));
  expect(heads()).toBe("Token, Created, Valid until, Last used, Actions");
});

it("has no table without tokens", () => {
  show([]);
  expect(screen.queryByRole("table")).toBeNull();
});

it("revokes the token of the row", async () => {
  const revoke = show(TOKENS);
  fireEvent.click(screen.getByRole("button", { name: "Revoke Weekly figures" }));
  await waitFor(() => expect(revoke.mock.calls[0]?.[0]).toBe(TOKENS[1]?.id));
});
