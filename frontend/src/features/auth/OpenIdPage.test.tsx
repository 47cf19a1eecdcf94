import { MantineProvider } from "@mantine/core";
import { QueryClient, QueryClientProvider } from "@tanstack/react-query";
import { cleanup, render, screen } from "@testing-library/react";
import { afterEach, expect, it } from "vitest";
import { TestRouter } from "../../app/TestRouter";
import { OpenIdPage } from "./OpenIdPage";

afterEach(cleanup);

it("says why it cannot sign in without the provider's reply", async () => {
  render(
    <MantineProvider env="test">
      <QueryClientProvider client={new QueryClient()}>
        <TestRouter>
          <OpenIdPage />
        </TestRouter>
      </QueryClientProvider>
    </MantineProvider>,
  );
  expect(await screen.findByText(/received no reply from the sign-in provider/)).toBeTruthy();
  expect(screen.getByRole("button", { name: "Back to sign-in" })).toBeTruthy();
});
